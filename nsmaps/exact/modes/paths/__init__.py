"""The motion between events, arrivals, and why a return ended."""
