"""Images of boxes of states of systems with modes, enclosed: rounding is counted, every state is accounted for."""
