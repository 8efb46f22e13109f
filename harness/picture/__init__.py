"""Pixels: picture files, colours, tiles, perceptual differences."""
