"""The files of figures (reports/paper/style.py)."""


def drawn_files(*stems):
    """Their names, sorted."""
    return sorted(f"{stem}.{kind}" for stem in stems for kind in ("json", "pdf", "png", "svg"))
