"""Rays side by side, a lane each (VEC-1)."""
