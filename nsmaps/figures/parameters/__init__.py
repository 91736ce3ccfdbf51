"""Figures over one parameter or over the plane of two."""
