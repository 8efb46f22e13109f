"""Ladders: cells in an order, each of which differs from the one before it in one thing."""

from typing import Annotated, Any, Literal

from pydantic import Field

from harness.toml import Strict

Name = Annotated[str, Field(min_length=1)]


class Rung(Strict):
    """A cell of a ladder. image: what of [image] is other for it. changes: what differs from the rung before it."""

    name: Name
    renderer: str
    changes: Name
    image: dict[str, Any] = {}


class Ladder(Strict):
    """Rungs from the first to the last. study: the program of the study's table 4.1 that the first rung stands for."""

    name: Name
    study: Literal["python", "numba", "cpp"] | None = None
    rung: Annotated[tuple[Rung, ...], Field(min_length=2)]


def points(ladders: tuple[Ladder, ...], image: dict[str, Any]) -> list[dict[str, Any]]:
    """Returns what of `image` is other on some rung, each such table once."""
    tables = {repr(sorted(own.items())): own for each in ladders for rung in each.rung for own in [_own(rung, image)]}
    return list(tables.values())


def climbers(ladders: tuple[Ladder, ...], image: dict[str, Any], point: dict[str, Any]) -> set[str]:
    """Returns the variants that have a rung at a point of `points`."""
    return {rung.renderer for each in ladders for rung in each.rung if _own(rung, image) == point}


def _own(rung: Rung, image: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in rung.image.items() if image[key] != value}
