"""How far off pictures are, against time."""
