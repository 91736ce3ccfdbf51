"""Maps given by formulas in pieces: the formulas, and the compiled loop that evaluates them."""
