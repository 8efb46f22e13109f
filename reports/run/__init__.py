"""A stored run read back: rows, cells, views, names of methods, the study's numbers."""
