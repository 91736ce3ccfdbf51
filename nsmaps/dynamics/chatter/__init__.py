"""Complete chatter as one event, and what replaces it beyond the orbit at which it ends."""
