"""Sections of sets of states: attracting domains, Morse sets, exit times."""
