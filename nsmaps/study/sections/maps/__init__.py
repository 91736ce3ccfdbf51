"""Sections of surfaces and of the reduced map: what is returned, what is fitted, how the pieces make one map."""
