"""Limits what a report shows, so that a run of thousands of cells stays readable; CSV files always hold everything."""


def few(items: list, most: int) -> list:
    """Returns at most `most` items in their order, evenly spread, with the first and the last."""
    if len(items) <= most:
        return items
    return [items[round(n * (len(items) - 1) / max(1, most - 1))] for n in range(most)]


def note(shown: int, total: int, what: str, rest: str) -> str:
    """Returns a sentence that only some are shown and where the others are; "" if all are shown."""
    return f"Shown are {shown} of {total} {what}, evenly spread; {rest}." if shown < total else ""
