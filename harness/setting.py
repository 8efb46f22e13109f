"""Parses settings of the command line: key=value, with a dotted key and a value as in TOML."""

import tomllib

from harness.errors import UserError


def put(tables: dict, setting: str, option: str, example: str) -> None:
    """Puts `setting` into `tables`. option: its flag; example: a valid one, for messages. UserError if it is none."""
    key, equals, text = setting.partition("=")
    if not equals or not key:
        raise UserError(f"{option} {setting}: expected key=value, such as {example}")
    try:
        value = tomllib.loads(f"x = {text}")["x"]
    except tomllib.TOMLDecodeError:
        value = text  # an unquoted word is a string
    except (ValueError, RecursionError) as error:
        raise UserError(f"{option} {key}: not a value: {error}") from None
    *place, last = key.strip().split(".")
    for step in place:
        tables = tables.setdefault(step, {})
        if not isinstance(tables, dict):
            raise UserError(f"{option} {setting}: {step} is not a table")
    tables[last] = value
