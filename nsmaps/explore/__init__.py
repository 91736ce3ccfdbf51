"""Exploration by hand in a browser: an offline page of a run (`page`), and a live one of a system (`live`)."""
