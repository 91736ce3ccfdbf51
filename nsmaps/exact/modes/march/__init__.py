"""From event to event: first zeros of guards, flights, contact, first returns.

Units are those of the system, phases are in radians.
"""
