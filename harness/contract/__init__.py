"""The contract test that any author of a renderer runs."""
