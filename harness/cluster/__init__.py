"""A run on a cluster: cut into jobs, submitted, followed."""
