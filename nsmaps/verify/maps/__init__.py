"""Verification of what is claimed of maps given by formulas: cycles, horseshoes and forward invariant sets of cells."""
