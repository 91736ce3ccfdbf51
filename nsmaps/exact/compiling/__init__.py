"""Compiled functions, and the folder in which they are kept."""
