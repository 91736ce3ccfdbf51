"""Quantities of impacts and of flights, summed in the compiled loop of returns.

Units are those of the system, phases are in radians.
"""
