"""The kinds of shapes: where a ray meets them."""
