"""Figures of first returns: surfaces, projections, slices, words."""
