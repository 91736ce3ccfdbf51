"""Rotation numbers of orbits, and the steps of rotation numbers over a parameter."""
