"""Return maps to any tolerance: polynomials in strips between the edges of the exact map. Planar."""
