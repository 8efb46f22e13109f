"""Starts renderers, measures, judges and stores their results. Talks to renderers only through processes."""
