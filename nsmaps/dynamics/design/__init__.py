"""Design: an observable of a periodic motion, maximised over parameters under conditions."""
