"""The growth of frames of tangent vectors along orbits, from which Lyapunov exponents follow."""
