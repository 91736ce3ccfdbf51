"""Images of boxes of states, enclosed: rounding is counted, every state is accounted for."""
