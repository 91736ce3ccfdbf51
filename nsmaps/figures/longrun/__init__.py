"""Figures of the long run at fixed parameters: basins, manifolds, noise, observables."""
