"""Curves in two parameters on which a periodic orbit bifurcates, and the points of codimension two on them."""
