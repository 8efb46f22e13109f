"""Parses settings of the command line: key=value, the value as in TOML, the key dotted."""

import tomllib

from harness.errors import UserError


def put(tables: dict, setting: str, option: str, example: str) -> None:
    """Put `setting` into `tables`. option: the flag that it was given by; example: of what is expected there."""
    key, equals, text = setting.partition("=")
    if not equals or not key:
        raise UserError(f"{option} {setting}: expected key=value, such as {example}")
    try:
        value = tomllib.loads(f"x = {text}")["x"]
    except tomllib.TOMLDecodeError:
        value = text  # a bare word is a string
    except (ValueError, RecursionError) as error:
        raise UserError(f"{option} {key}: not a value: {error}") from None
    *place, last = key.strip().split(".")
    for step in place:
        tables = tables.setdefault(step, {})
        if not isinstance(tables, dict):
            raise UserError(f"{option} {setting}: {step} is no table")
    tables[last] = value
