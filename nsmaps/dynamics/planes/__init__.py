"""Charts: the attractors of a system over the plane of two parameters."""
