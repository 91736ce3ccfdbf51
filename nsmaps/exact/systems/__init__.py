"""Systems as their classes define them: parameters, walls, guards, formulas and the checks of these."""
