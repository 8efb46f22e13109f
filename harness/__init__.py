"""Starts, measures, judges and stores. Talks to renderers only through processes."""
