"""What the eye sees: its rays through pixels and lens, and the samples of a pixel."""
