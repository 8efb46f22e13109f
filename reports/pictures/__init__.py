"""Figures that are pictures."""
