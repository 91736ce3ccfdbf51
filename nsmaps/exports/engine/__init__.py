"""Compiled functions in other languages, translated from their source with the numbers of one system put in."""
