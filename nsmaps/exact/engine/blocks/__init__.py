"""Many returns in parallel, in vector instructions."""
