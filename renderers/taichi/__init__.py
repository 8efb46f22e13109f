"""The kernel in Taichi."""
