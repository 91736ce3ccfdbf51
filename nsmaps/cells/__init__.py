"""The state space in cells: transition graphs, Morse sets, exit times, and periodic points found by excluding cells."""
