"""Figures of a study: what each shows of its result, and the files that are drawn."""
