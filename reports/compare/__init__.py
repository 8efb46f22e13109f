"""Runs and machines beside each other."""
