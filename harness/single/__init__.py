"""One picture from the command line: whole, in tiles, or as another program's file."""
