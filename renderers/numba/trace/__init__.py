"""What a ray brings back: tracing, walks through the rays that follow, light, and what a ray is in."""
