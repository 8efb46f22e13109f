"""One source of typed Python for compilers of Python."""
