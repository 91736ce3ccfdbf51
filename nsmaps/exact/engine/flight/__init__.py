"""A flight as a table of numbers, and its evaluation, remainders and bounds.

Units are those of the system, phases are in radians.
"""
