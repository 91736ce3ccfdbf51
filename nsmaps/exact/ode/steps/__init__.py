"""Steps of integrated flights: whether their Taylor series is the flight, and what is left of them."""
