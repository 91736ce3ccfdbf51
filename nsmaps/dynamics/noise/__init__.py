"""Return maps under noise: orbits, and how long they stay in which motion."""
