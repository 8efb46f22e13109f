"""Medians, intervals, noise floors, steady states, fits."""
