"""Figures of auxiliary maps and attracting domains."""
