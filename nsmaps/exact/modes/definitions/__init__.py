"""From a system's formulas to its definition: modes, guards, resets, sections."""
