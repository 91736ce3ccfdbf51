"""The general algorithm of section 4.1: the state space divided until every region meets its tolerance. Planar."""
