"""One picture from the command line: rendered, or as another program's file."""
