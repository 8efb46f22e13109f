"""Compares runs and machines."""
