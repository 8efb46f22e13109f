"""Rows of the catalogue of failures: leaving surfaces, optics, shading."""
