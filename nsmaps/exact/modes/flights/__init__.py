"""Flights of a mode in pieces: by power series of its affine flow, or by Taylor series of any smooth one.

Units are those of the system, phases are in radians.
"""
