"""Prints the facts of a picture that a command made (harness/single, harness/choice)."""

import sys


def show(facts: dict, precision: str, time: str = "") -> None:
    """Prints the facts of a picture. time: what was measured of a frame; without it a rough time is printed."""
    took = f"{facts['wall_s']:.3g} s in all"
    took = f"{time}, {took}" if time else f"about {facts['rough_seconds']:.2g} s a frame, {took} (rough times)"
    print(
        f"{facts['picture']}: {facts['width']} x {facts['height']}, {facts['renderer']}, {precision}: "
        f"{took}, {_traced(facts['rays'])}"
    )
    _show_doubts(facts)


def _traced(counts: dict | None) -> str:
    """The number of rays, for people. counts: by kind, or None."""
    if not counts:
        return "rays unavailable: the renderer does not count them"
    total = sum(counts.get(kind, 0) for kind in ("primary", "reflected", "transmitted", "shadow"))
    return f"{total:,} rays"


def _show_doubts(facts: dict) -> None:
    """Prints the bound of a cut-off, and warnings."""
    if facts["bound"]:
        print(
            f"cut-off: every pixel is within {facts['bound']['max']:.3g} of the picture without it,"
            f" on average within {facts['bound']['mean']:.3g} (linear RGB, proven)"
        )
    if facts["unranked"]:
        print(f"note: {facts['unranked']}", file=sys.stderr)
    if (facts["rays"] or {}).get("non_finite"):
        print(f"warning: {facts['rays']['non_finite']} samples are not finite", file=sys.stderr)


def warn(warnings: list[str]) -> list[str]:
    """Prints the warnings about a scene whose picture has been saved; returns them."""
    for text in warnings:
        print(f"warning: {text}", file=sys.stderr)
    return warnings
