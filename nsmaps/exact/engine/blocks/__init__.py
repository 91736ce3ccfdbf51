"""Many returns in parallel, in vector instructions. Units are those of the system, phases are in radians."""
