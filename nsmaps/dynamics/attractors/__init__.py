"""Attractors: what orbits end on, their basins, their distance, their coexistence along a parameter."""
