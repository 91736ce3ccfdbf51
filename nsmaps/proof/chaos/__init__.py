"""The search for sets of a horseshoe, in floats, for maps of any number of coordinates."""
