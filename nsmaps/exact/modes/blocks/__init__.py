"""Many motions in parallel."""
