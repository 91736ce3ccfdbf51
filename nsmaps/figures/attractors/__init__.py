"""Figures of attractors: their motions over a period, their Poincare sections, and systems at a glance."""
