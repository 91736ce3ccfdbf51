"""Figures of the system itself: its sketch, its motion, its impacts, and the algorithm."""
