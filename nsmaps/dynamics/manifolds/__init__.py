"""Stable and unstable manifolds of saddles of planar return maps."""
