"""Images of boxes of states of systems with modes, enclosed: rounding is counted, every state is accounted for.

Times are in cells of the mode, other quantities in the units of the system, phases in radians.
"""
