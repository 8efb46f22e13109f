"""Pixels: picture files, colours, perceptual differences."""
