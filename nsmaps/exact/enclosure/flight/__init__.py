"""The flight of a table in ball arithmetic, over sets of states and of times.

Units are those of the system, phases are in radians.
"""
