"""The engine under noise: flights with Ornstein-Uhlenbeck forcing, and orbits of them."""
