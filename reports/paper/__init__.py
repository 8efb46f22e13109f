"""How reports are written and drawn: tables, Markdown, LaTeX, numbers, style of figures."""
