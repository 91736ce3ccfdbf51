"""The motion of a system at and between impacts or events, sampled, and first arrivals at a section."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, finite_rows
from nsmaps.coordinates import Coordinates
from nsmaps.errors import StateError
from nsmaps.exact.returns import Impacts
from nsmaps.exact.words import words_of
from nsmaps.results import NONE, TIME, TURNS, Result, array, array_property


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Events(Result):
    """M events of one motion of a system with modes, in their order."""

    name: NDArray[np.str_] = field(metadata=array("event", "of the guard, or 'slip to stick' at a surface of sliding", NONE))
    letter: NDArray[np.str_] = field(metadata=array("event", "letter of the event", NONE))
    time: Floats = field(metadata=array("event", "since the start, in the system's time", TIME))
    phase: Floats = field(metadata=array("event", "radians in [0, 2 pi); zero without forcing", "rad"))
    before: Floats = field(
        metadata=array("event state", "states just before; at a start just after the section's reset, those after it")
    )
    after: Floats = field(metadata=array("event state", "states just after"))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Track(Result):
    """The motion through M impacts, `samples` instants in each of the M - 1 flights between them, with W walls.

    A rest or chatter on a wall counts as a flight along it. Displacement is relative to the walls; places are those of
    `ImpactSystem.absolute`, relative to an observer at rest.
    """

    impacts: Impacts
    sides: NDArray[np.int8] = field(metadata=array("wall", "+1 for a wall that growing displacement meets, else -1", NONE))
    at: Floats = field(metadata=array("wall", "displacement of each wall"))
    time: Floats = field(metadata=array("flight sample", "since the start, in the system's time", TIME))
    displacement: Floats = field(metadata=array("flight sample", "relative to the walls"))
    velocity: Floats = field(metadata=array("flight sample", "rate of the displacement"))
    ball: Floats = field(metadata=array("flight sample", "place of the ball"))
    walls: Floats = field(metadata=array("wall flight sample", "places of the walls"))
    units: Mapping[str, str] = field(default_factory=dict)
    picture: ClassVar[str] = "nsmaps.figures.system.motion"

    def summary(self) -> str:
        """The numbers that matter."""
        ends = f"{self.time.min():.4g} to {self.time.max():.4g}"
        return f"{len(self.impacts.time)} impacts on {', '.join(self.impacts.walls)}, time {ends}"

    @array_property("impact", "velocity just before each impact")
    def rates(self) -> Floats:
        """Velocity just before each impact, shape (M,): the impact speed with the sign of its wall's side."""
        return np.asarray(self.sides[self.impacts.wall] * self.impacts.speed, float)

    @property
    def moving(self) -> bool:
        """True if the system defines the motion of its walls."""
        return bool((np.ptp(self.walls.reshape(len(self.at), -1), axis=1) > 0).any())


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ModeTrack(Result):
    """The motion of a system with n states through M events, `samples` instants in each of the M - 1 flights between them."""

    names: tuple[str, ...]  #: of the states
    events: Events
    modes: NDArray[np.str_] = field(metadata=array("flight", "of each flight, sliding and contact among them", NONE))
    time: Floats = field(metadata=array("flight sample", "since the start", TIME))
    states: Floats = field(metadata=array("flight sample state", "the states of the system"))
    coordinates: Coordinates | None = None  #: of the section; None in earlier runs
    units: Mapping[str, str] = field(default_factory=dict)
    picture: ClassVar[str] = "nsmaps.figures.system.motion"

    def summary(self) -> str:
        """The numbers that matter."""
        modes = ", ".join(dict.fromkeys(self.modes.tolist()))
        return f"{len(self.events.time)} events of ({', '.join(self.names)}) through {modes}"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Arrivals(Result):
    """First arrivals of N states of a system with modes at its section, of m coordinates."""

    coordinates: Coordinates  #: of the section
    names: Coordinates  #: of the start: the states, and the phase where there is forcing
    letters: tuple[str, ...]
    start: Floats = field(metadata=array("state start_coordinate", "as given"))
    mode: NDArray[np.str_] = field(
        metadata=array("state", "in which the motion starts, '' where the state belongs to none", NONE)
    )
    image: Floats = field(metadata=array("state coordinate", "at the section, angles in [0, 2 pi); NaN where there is none"))
    turns: NDArray[np.int32] = field(metadata=array("state coordinate", "whole turns of an angle until then", TURNS))
    codes: NDArray[np.int64]  #: shape (N,), words as numbers; see `words`
    outcome: NDArray[np.int8] = field(metadata=array("state", "values of `Outcome`", NONE))
    time: Floats = field(
        metadata=array("state", "until the arrival, or as of `Returns`, in the system's time; NaN where unknown", TIME)
    )
    derivative: Floats | None = field(
        default=None, metadata=array("state coordinate start_coordinate", "d image / d start, if requested")
    )

    def __len__(self) -> int:
        return len(self.start)

    @array_property("state", "events until the arrival", NONE)
    def words(self) -> NDArray[np.str_]:
        """The events of each motion, that at the section the last, shape (N,)."""
        return words_of(self.codes, self.letters)

    @property
    def valid(self) -> NDArray[np.bool_]:
        """The arrivals that have an image, shape (N,)."""
        return finite_rows(self.image)


def check_samples(n: int, samples: int) -> None:
    """Refuse fewer than two impacts or events, or two samples of a flight, by a StateError."""
    if n < 2 or samples < 2:
        raise StateError(f"{n} impacts or events of {samples} samples a flight; expected: two or more of each")
