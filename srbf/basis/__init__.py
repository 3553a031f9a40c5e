"""Function spaces on the sphere of light directions, one per file."""
