"""Figures of the composite map: its pieces, cobwebs, orbits, strips, and its speed."""
