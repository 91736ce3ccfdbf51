"""Flights as data: from a formula in sympy to the tables that the engine marches."""
