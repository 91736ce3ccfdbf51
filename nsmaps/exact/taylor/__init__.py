"""Taylor series of nonlinear flights: heyoka's programs of the formulas of modes, and laws compiled beside them."""
