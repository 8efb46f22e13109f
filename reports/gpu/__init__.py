"""What a GPU did, and launch shapes."""
