"""An offline page of a run: its map follows the parameter that is dragged, exact flights and surfaces stand beside it."""
