"""One repetition: the launcher, the renderer's process, the measurer beside it, temporary folders."""
