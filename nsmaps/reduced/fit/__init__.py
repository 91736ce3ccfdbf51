"""Polynomials fitted to return surfaces: fits, filters near the diagonals, least squares."""
