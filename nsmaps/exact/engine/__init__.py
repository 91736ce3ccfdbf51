"""The engine: flights given as tables, marched from impact to impact and from return to return by code compiled once.

Units are those of the system, phases are in radians.
"""
