"""Integrated flights as they were flown: steps, each a Taylor polynomial that was compared with the equation of motion."""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Floats

DOUBTS = (
    "",
    "A flight meets or passes a wall so slowly that rounding errors of its place decide which, or change the speed of the impact "
    "by more than 3e-5 of it: a graze within rounding. Impact speeds far below those of the flight are better known of flights "
    "in closed form (`displacement`).",
    "A flight amplifies rounding errors until its place is not known to 1e-10 of the way flown: it is chaotic before it meets a "
    "wall, and the image is one of many.",
    "At a state that a flight comes to, the acceleration is so steep that no Taylor series agrees with it, or it has no "
    "value, as the root of a negative number or exp beyond the range of floats. Make the steep part wider, to 1e-12 of the range "
    "of its argument or more, or restrict the starts.",
    "A flight takes more than 100,000 steps: the acceleration is stiff there, as where smoothed friction holds the ball. Make "
    "the steep part wider, or let the ball stick to a wall.",
)  #: why a return is undecided, by the values of UNSURE in `layout`


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """A step of a flight."""

    begin: float  #: since the impact, in the system's time
    length: float
    place: Floats  #: shape (order + 1,), Taylor coefficients of the displacement since the impact
    velocity: Floats  #: the same

    def at(self, since: Floats) -> Floats:
        """Displacement since the impact and velocity, at times since the impact that lie in the step, shape (2, K)."""
        return np.asarray(
            np.polynomial.polynomial.polyval(since - self.begin, np.column_stack([self.place, self.velocity])), float
        )
