"""What a renderer is, and what passes between it and the harness: manifest, build, job, events, limits."""
