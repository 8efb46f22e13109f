"""Draws the figures that show pictures."""
