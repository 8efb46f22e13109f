"""Rows of the catalogue of failures: where rays meet shapes."""
