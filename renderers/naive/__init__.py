"""The study's scene by naive C++: what SPEC.md's guards against rounding cost."""
