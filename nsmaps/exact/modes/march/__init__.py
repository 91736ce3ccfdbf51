"""From event to event: first zeros of guards, flights, contact, first returns."""
