"""The engine under noise: flights with Ornstein-Uhlenbeck forcing, and orbits of them.

Units are those of the system, phases are in radians.
"""
