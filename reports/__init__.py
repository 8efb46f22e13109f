"""Figures and tables. Reads result files, nothing else."""
