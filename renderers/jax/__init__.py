"""The light model in JAX."""
