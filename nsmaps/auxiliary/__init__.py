"""Where it ends up: auxiliary maps, attracting domains, closed forms of iterates (section 6 of the paper)."""
