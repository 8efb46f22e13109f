"""Limits what a report shows, so that thousands of cells stay readable: CSV files always have all."""


def few(items: list, most: int) -> list:
    """At most `most` of the items, in their order, evenly spread, the first and the last among them."""
    if len(items) <= most:
        return items
    return [items[round(n * (len(items) - 1) / max(1, most - 1))] for n in range(most)]


def told(shown: int, there: int, what: str, rest: str) -> str:
    """ "" or a sentence that not all are shown, and where the others are."""
    return f"Shown are {shown} of {there} {what}, evenly spread; {rest}." if shown < there else ""
