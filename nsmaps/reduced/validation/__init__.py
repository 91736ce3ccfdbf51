"""How a composite map compares with the exact one: its words, its speed."""
