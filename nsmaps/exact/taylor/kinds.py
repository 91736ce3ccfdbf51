"""Kinds of functions with flat parts, by the length of their argument over which they change."""

EXP, TANH, ERF, ORIGIN, ARCS, EDGES, EDGE = range(7)
NO_KIND = -1
