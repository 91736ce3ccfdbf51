"""Auxiliary maps and the attracting domains that they bound (section 6 of the paper)."""
