"""Gives a drawing other colours where the page that it is embedded in is dark."""

import re

from reports.paper import style

INK, PAPER = (0xE6, 0xE9, 0xEC), (0x1E, 0x23, 0x28)  # what black and white become
SAME = 8  # by which the channels of a grey differ
PALE = 0xA8  # least channel of a tint that lies behind text
COLOUR = re.compile(rb"(?:fill|stroke): (#[0-9a-f]{6})")


def for_page(svg: bytes) -> bytes:
    """Returns a drawing, an SVG file of matplotlib, with colours for a dark page, which a browser then takes."""
    colours = dict.fromkeys(colour.decode() for colour in COLOUR.findall(svg))
    changed = [(colour, other) for colour in colours if (other := dark(colour)) != colour]
    rules = [
        f'[style*="{what}: {colour}"]{{{what}:{other}!important}}'
        for colour, other in changed
        for what in ("fill", "stroke")
    ]
    look = f"@media (prefers-color-scheme: dark){{svg{{fill:{_text(INK)}}}{''.join(rules)}}}"
    return svg.replace(b"</defs>", f"<style>{look}</style></defs>".encode(), 1)


def dark(colour: str) -> str:
    """Returns the colour, "#rrggbb", that stands for `colour` on a dark page.

    Greys are turned over, tints become dark, and the colours of renderers stay, unless they are too dark.
    """
    if colour in style.FIXED:
        return colour
    if (other := style.dark(colour.upper())) != colour.upper():
        return other.lower()
    channels = tuple(int(colour[place : place + 2], 16) for place in (1, 3, 5))
    if max(channels) - min(channels) <= SAME:
        return _text(_between(INK, PAPER, sum(channels) / 3 / 255))
    if min(channels) >= PALE or colour.upper() in style.PHASES.values():
        return _text(_between(channels, PAPER, 0.55))
    return colour


def _between(first: tuple, other: tuple, share: float) -> tuple:
    return tuple(round(a + (b - a) * share) for a, b in zip(first, other, strict=True))


def _text(channels: tuple) -> str:
    return "#" + "".join(f"{channel:02x}" for channel in channels)
