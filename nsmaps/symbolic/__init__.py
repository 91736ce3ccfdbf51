"""Closed forms: exact polynomial formulas, iterates of curves and maps, two-cycles."""
