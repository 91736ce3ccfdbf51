"""Images of boxes of states, enclosed: rounding is counted, every state is accounted for.

Units are those of the system, phases are in radians.
"""
