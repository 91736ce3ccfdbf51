"""Figures of fits near the diagonals and of separable maps."""
