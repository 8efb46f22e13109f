"""Rows of the catalogue of failures: ray tables, threads, rounding that grows with depth."""
