"""Figures of estimates from measured data, and of what is uncertain."""
