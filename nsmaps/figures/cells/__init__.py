"""Figures of cells: Morse sets and exit times."""
