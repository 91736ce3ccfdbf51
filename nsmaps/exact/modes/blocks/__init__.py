"""Many motions in parallel.

Times within a flight are in longest steps of its mode, other quantities in the units of the system, phases in radians.
"""
