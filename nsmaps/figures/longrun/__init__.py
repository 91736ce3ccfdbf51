"""Figures of the long run: bifurcations, branches, stability, exponents, basins, noise."""
