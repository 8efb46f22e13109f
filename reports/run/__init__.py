"""Reads a stored run back: rows, cells, views, names of methods, the study's numbers."""
