"""Events derived from rates: contact that lasts, sliding, crossings of functions that may be negative."""
