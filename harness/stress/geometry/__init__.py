"""Rows of the catalogue of failures: intersections of rays and shapes."""
