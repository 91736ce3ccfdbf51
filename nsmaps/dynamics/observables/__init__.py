"""Means of observables along orbits, with their errors, and their derivatives by parameters."""
