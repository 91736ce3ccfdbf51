"""Multiple shooting: the model from event to event, the pairing of impacts, guesses, and least squares."""
