"""Says swept values in words."""

PLURALS = "objects", "lights", "frames", "rays", "spots"


def spoken(key: str, value) -> str:
    """Returns a swept value in words: "192 objects", "one pixel", "depth 3"."""
    if key == "case" or (key, value) == ("region", "one pixel"):
        return str(value)
    if (key, value) == ("region", "all"):
        return "all pixels"
    if key == "side":
        return f"{value} × {value}"
    if key in PLURALS:
        return f"{value} {key[:-1] if value == 1 else key}"
    return f"{key.replace('_', ' ')} {value}"


def of_point(point: dict) -> str:
    """Returns swept values in words: "192 objects, depth 3"."""
    return ", ".join(spoken(key, value) for key, value in point.items())
