"""The reference to read: plain Python, one ray at a time, generic over the type of number."""
