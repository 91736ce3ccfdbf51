"""What orbits end on: many successive returns with the growth of tangent vectors on them, and what they show."""
