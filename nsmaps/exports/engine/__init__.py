"""The compiled engine of impact systems in other languages: its own functions, translated from their source."""
