"""Motions that are looked at: of attractors over a period, and beside a graze."""
