"""Flights of a mode in pieces: by power series of its affine flow, or by Taylor series of any smooth one."""
