"""The numbers of a system at its parameters: series of its flows and memory for marching."""
