"""Scenes and meshes that are generated instead of read."""
