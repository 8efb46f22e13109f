"""Reports where methods fail as the stress on them grows."""
