"""Reports how long renderers take, and how much memory and processor time they use."""
