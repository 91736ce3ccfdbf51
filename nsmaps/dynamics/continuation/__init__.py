"""Continuation of periodic orbits in a parameter, with the events on their branches."""
