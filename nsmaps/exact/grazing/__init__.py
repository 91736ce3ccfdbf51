"""Grazing: the curves of states whose first return touches a wall with speed zero."""
