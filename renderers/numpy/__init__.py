"""A wavefront of arrays: all rays of a chunk at once, one array operation after the other."""
