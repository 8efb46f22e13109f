"""Identifies this machine and checks whether it is fit to measure."""
