"""Sections of the motion after many returns, at fixed parameters."""
