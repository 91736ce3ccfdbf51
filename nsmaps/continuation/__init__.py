"""Curves given by equations, followed by pseudo-arclength continuation, and edges found by bisection."""
