"""Rows of the catalogue of failures: rays that leave surfaces, optics, shading."""
