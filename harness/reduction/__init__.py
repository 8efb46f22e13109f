"""Smaller models of a scene and its job: what can be left out, what of that is proved to contribute nothing."""
