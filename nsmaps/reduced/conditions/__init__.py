"""Regions of the state space and the conditions that define them: read from text, evaluated, compiled."""
