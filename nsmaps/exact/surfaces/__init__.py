"""Return surfaces: grids of starts, families of impact words, the surfaces over them, compositions and slices."""
