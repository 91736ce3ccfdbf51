"""Exact first returns as programs in C and Julia: around functions of the engine, the numbers of one system."""
