"""Flights without a closed form: the equation of motion integrated by Taylor's method, with heyoka."""
