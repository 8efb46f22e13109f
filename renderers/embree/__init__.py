"""Embree finds the hits of rays; NumPy does the rest."""
