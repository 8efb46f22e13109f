"""Embree finds what rays hit; NumPy does the rest."""
