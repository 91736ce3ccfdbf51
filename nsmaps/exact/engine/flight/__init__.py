"""A flight as a table of numbers, and its evaluation, remainders and bounds."""
