"""The composite map: pieces in order, compiled, with coefficients that may be polynomials of a parameter."""
