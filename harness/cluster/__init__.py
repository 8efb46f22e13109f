"""The same run cut into jobs for a cluster."""
