"""What we put in the map's place: regions, polynomials fitted on them, the composite map."""
