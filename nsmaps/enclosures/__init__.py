"""Outer bounds over boxes: of polynomials, conditions and fitted maps."""
