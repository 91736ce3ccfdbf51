"""The attractors of a system over the plane of two of its parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.dynamics.attractors.quantifiers import quantifier_array
from nsmaps.dynamics.motion import ESCAPE
from nsmaps.dynamics.planes.motions import Motion
from nsmaps.exact.outcome import OUTCOMES, Outcome
from nsmaps.results import NONE, RETURNS, Result, array, array_property, range_text, shares_text

ORBITS = "across along start"  #: axes of an array of orbits


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ParameterPlane(WithCoordinates, Result):
    """The attractors over W values of one parameter by V of another, each reached by S orbits of n coordinates.

    At pixels that are not `computed`, as with `refine`, attractors are those of a neighbour, continued to the parameters there;
    `probes` bound the share of these pixels at which the starts reach others.
    """

    picture: ClassVar[str] = "nsmaps.figures.parameters.parameter_plane"

    coordinates: Coordinates
    parameters: tuple[str, str]  #: names of the one along and of the one across
    along: Floats = field(metadata=array("along", "values of the first parameter", name="first"))
    across: Floats = field(metadata=array("across", "values of the second parameter", name="second"))
    motions: tuple[Motion, ...]  #: every motion that occurs, once
    motion: NDArray[np.int32] = field(metadata=array(ORBITS, "number of the motion of each orbit; -1 where it ended", NONE))
    attractor: NDArray[np.int8] = field(metadata=array(ORBITS, "number of the attractor at its pixel; -1 where it ended", NONE))
    exponent: Floats = field(metadata=array(ORBITS, "largest Lyapunov exponent; NaN where unknown", "per return"))
    outcome: NDArray[np.int8] = field(metadata=array(ORBITS, f"of the last return: {OUTCOMES}", NONE))
    state: Floats = field(metadata=array(f"{ORBITS} coordinate", "last state of each orbit; NaN where it ended"))
    observables: tuple[str, ...]  #: names of K observables
    means: Floats = field(metadata=array(f"{ORBITS} observable", "means per period of the forcing, without forcing per return"))
    refused: Bools = field(metadata=array("across along", "where there is no map", NONE))
    computed: Bools = field(metadata=array("across along", "where orbits of the starts were computed", NONE))
    reason: str  #: the first reason why there is no map; "" if there is one everywhere
    n_returns: int  #: number of returns computed; others are repetitions
    probes: int = 0  #: number of pixels that were to be continued, drawn at random and computed as well; 0 without any
    differing: int = 0  #: number of these at which the starts reach another motion than the continued one
    units: Mapping[str, str] = field(default_factory=dict)  #: of coordinates and parameters, by name
    quantifiers: Mapping[str, Floats] = field(default_factory=dict, metadata=quantifier_array(ORBITS))

    def summary(self) -> str:
        """The numbers that matter."""
        along, across = range_text(self.first, self.along), range_text(self.second, self.across)
        shares = self.shares()
        listed = shares_text([*shares][:6], [*shares.values()][:6]) + (f" and {len(shares) - 6} more" if len(shares) > 6 else "")
        return f"{along}, {across}: {listed or 'no attractor'}"

    @property
    def first(self) -> str:
        """The name of the parameter along."""
        return self.parameters[0]

    @property
    def second(self) -> str:
        """The name of the parameter across."""
        return self.parameters[1]

    @array_property(ORBITS, "period, a complete chatter with its release as one; 0: none found, -1: the orbit ended", RETURNS)
    def period(self) -> Ints:
        """The period of each orbit in returns, shape (W, V, S), as of `Motion`; 0: none found, -1: it ended."""
        return np.array([*(motion.period for motion in self.motions), -1])[self.motion]

    @array_property(ORBITS, "periods of the forcing in one period; 0: none found, -1: the orbit ended", NONE)
    def turns(self) -> Ints:
        """The period of each orbit in periods of the forcing, shape (W, V, S); 0: none found, -1: it ended."""
        return np.array([*(motion.turns for motion in self.motions), -1])[self.motion]

    @array_property(ORBITS, "name of the motion, such as 1:1/2T; empty where the orbit ended", NONE)
    def labels(self) -> NDArray[np.str_]:
        """The motion of each orbit, shape (W, V, S), such as 1:1/2T; "" where it ended, `escapes` where it leaves every bound."""
        names = np.array([*(motion.label for motion in self.motions), "", ESCAPE])
        return names[np.where((self.motion < 0) & (self.outcome != Outcome.escaped), -2, self.motion)]

    @array_property(ORBITS, "impact words of one period, or all words without one", NONE)
    def words(self) -> NDArray[np.str_]:
        """The words of each orbit, shape (W, V, S), with blanks between; see `Motion.words`."""
        return np.array([*(" ".join(motion.words) for motion in self.motions), ""])[self.motion]

    @property
    def counts(self) -> Ints:
        """The number of attractors at each pixel, shape (W, V)."""
        return self.attractor.max(axis=2).astype(np.int64) + 1

    @property
    def most_differing(self) -> float:
        """The largest share of the pixels not computed at which starts may reach others, at 95 % confidence; 0 without any."""
        if self.computed.all() or self.differing == self.probes:
            return 0.0 if self.computed.all() else 1.0
        from scipy.stats import beta

        return float(beta.ppf(0.95, self.differing + 1, self.probes - self.differing))

    def shares(self) -> dict[str, float]:
        """The fraction of the pixels at which each motion attracts an orbit, the most frequent first; pixels may count twice.

        Pixels that are not computed count with the attractors that were continued: see `computed` and `most_differing`.
        """
        kinds = list(dict.fromkeys(motion.label for motion in self.motions))
        found = np.sort(np.array([*(kinds.index(motion.label) for motion in self.motions), -1])[self.motion], axis=2)
        first = found >= 0
        first[..., 1:] &= found[..., 1:] != found[..., :-1]
        counts = np.bincount(found[first], minlength=len(kinds)) / self.refused.size
        return dict(sorted(zip(kinds, counts.tolist(), strict=True), key=lambda pair: -pair[1]))
