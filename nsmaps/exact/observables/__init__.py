"""Quantities of impacts and of flights, summed in the compiled loop of returns."""
