"""An impact system, defined once by walls, flight and impact law in sympy, from which the exact map is derived."""

import sys
from inspect import isabstract
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI, BoxLike, StateLike, as_starts, as_states
from nsmaps.errors import StateError, SystemDefinitionError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.events import Track
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Impacts
from nsmaps.exact.systems.files import REFUSED, defined_at
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.walls import ImpactFormulas
from nsmaps.parallel import fingerprint

if TYPE_CHECKING:
    from nsmaps.exact.enclosure.images import BoxImages
    from nsmaps.exact.grazing.curves import GrazingCurve

SPACING = 0.005  #: default of grazing curves, in sizes of the box
FLIGHTS, SAMPLES = 4, 9  #: flights after a state, and instants of each, at which the speed of its motion is looked at


class ImpactSystem(ImpactFormulas, FlowSystem):
    """A ball that flies between impacts with one or two walls under periodic forcing.

    Subclass it: the fields are the parameters; `walls`, `period` and `displacement` are formulas in `self` and its fields,
    written once and used both in numbers and, with sympy symbols in place of the parameters, to derive the compiled map.
    Where the flight has no closed form, `acceleration` takes the place of `displacement`: flights are then integrated by
    heyoka (extra `ode`), and no return is `certified`.
    A definition with modes follows from them (`ImpactFormulas`), by which `arrivals` start anywhere between the walls.
    A state is (v, phi): impact speed on the base wall (the first of `walls`) just before the impact, at least zero, and the phase
    of the forcing in radians. Fields that are not float (a choice, a switch) are part of the formula rather than symbols in it.
    """

    wanted: ClassVar[str] = "an ImpactSystem: what it rests on are flights between impacts with walls"

    def rests(self, states: ArrayLike) -> Floats:
        """How long the ball rests on the base wall in each first return that ends with its release, shape (N,); NaN of others.

        In radians of phase. Chatter that is summed counts with the rest. Errors as `first_return`.
        """
        returns = self.first_return(states)
        return np.asarray(np.where(returns.outcome == Outcome.stuck, returns.time * self.phase_rate(), np.nan))

    def grazing_curves(self, box: BoxLike, n_lines: int = 400, spacing: float = SPACING) -> "tuple[GrazingCurve, ...]":
        """The states in a box whose first return touches a wall with speed zero: the edges of the map's smooth pieces.

        Each curve is followed from a start point until it ends: at the `box`, at `rest` (its speed falls to zero), at another
        `graze` that comes first from there on, at an `inflection` (the flight no longer turns at the wall but crosses it), or
        where it is `lost` to rounding. Start points are changes of itinerary between neighbours of a scan: a curve is missed if
        all of it passes between them, or if the itinerary changes back before the next, or lies behind more impacts and turning
        points than the code of an itinerary holds (22 letters with two walls). Touches after a rest on a wall do not depend on
        the state and do not form curves.

        Args:
            box: as of `as_box`, speeds >= 0; phases within one turn, of which a whole one is a circle.
            n_lines: number of lines of the scan, in each direction.
            spacing: largest distance between points of a curve, in sizes of the box and periods of the flight's time.

        Raises:
            StateError: the box is not one of finite states, or `n_lines` or `spacing` are too small.
        """
        from nsmaps.exact.grazing.curves import grazing_curves

        return grazing_curves(self, box, n_lines, spacing)

    def image_boxes(self, boxes: ArrayLike) -> "BoxImages":
        """Boxes that contain the images of all states of each box, rounding errors included: an enclosure of the map.

        Args:
            boxes: shape (N, 2, 2), lower and upper end of speed and phase (radians, any turn). Speeds below zero are not states.

        Raises:
            StateError: `boxes` is not a batch of finite boxes.
            ProofError: the system's formulas have a part for which no enclosure is known.
        """
        from nsmaps.exact.enclosure.impacts import image_boxes

        return image_boxes(self, boxes)

    def impacts(self, start: StateLike, n_impacts: int, chatter: float = SUMMED_SPEED) -> Impacts:
        """The first n impacts on all walls of the trajectory from the impact `start`, shape (2,), on the base wall."""
        state = np.ascontiguousarray(as_starts(start, self.coordinates))
        speed, _ = state
        if not (speed >= 0 and np.isfinite(state).all()):
            raise StateError(f"the state {state} is not a start; expected: a finite impact speed >= 0 and a phase")
        if n_impacts < 1:
            raise StateError(f"n_impacts is {n_impacts}; expected: at least one impact")
        return self._kernel().impacts(state, n_impacts, chatter)

    def extents(self, states: ArrayLike) -> Floats:
        """The largest speed relative to the walls over the next four flights from each state, and a turn, shape (2,).

        Raises:
            StateError: `states` is not a batch of shape (N, 2), or one is not a start.
        """
        rows, kernel, fastest = as_states(states, self.coordinates), self._kernel(), 0.0
        for row in rows:
            hits = self.impacts(row, FLIGHTS + 1)
            _, _, rates = kernel.trajectory(hits, SAMPLES)
            fastest = max(fastest, float(hits.speed.max()), float(np.abs(rates).max(initial=0.0)))
        return np.array([fastest, TWO_PI])

    def trajectory(self, start: StateLike, n_events: int, n_samples: int = 50) -> tuple[Any, Any]:
        """Times and displacements along the flights between the first impacts from `start`, with `n_samples` points per flight.

        Two arrays of the same length in the system's units; a rest on a wall has as many points as a flight. For velocities,
        walls and absolute places see `nsmaps.exact.trajectory.track`.
        """
        times, places, _ = self._kernel().trajectory(self.impacts(start, n_events), n_samples)
        return times.ravel(), places.ravel()

    def _track(self, state: StateLike, n: int, samples: int, chatter: float) -> Track:
        """As `nsmaps.exact.trajectory.track`."""
        impacts = self.impacts(state, n, chatter)
        time, displacement, velocity = self._kernel().trajectory(impacts, samples)
        walls = self.walls().values()
        sides, at = np.array([wall.side for wall in walls], np.int8), np.array([float(wall.at) for wall in walls])
        clock = time + impacts.phase[:1] / self.phase_rate()
        ball = self.absolute(clock, displacement)
        places = np.array([self.absolute(clock, np.full(clock.shape, z)) for z in at])
        return Track(impacts, sides, at, time, displacement, velocity, np.asarray(ball, float), places)

    def _reversed_class(self) -> type[ImpactFormulas]:
        from nsmaps.exact.systems.reversed import reversed_impacts

        return reversed_impacts(self)

    def _check(self) -> None:
        """Refuse formulas of the class, with the places at which they are written."""
        from nsmaps.exact.flows.tables import formulas_of

        formulas_of(self)

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Refuse a subclass without an impact law, or from whose formulas no bounds can be derived, when it is defined.

        Formulas are checked only if sympy has been loaded by then, as by a file that imports it for them; it is not loaded for
        this check.
        """
        super().__pydantic_init_subclass__(**kwargs)
        if isabstract(cls):
            return
        try:
            _check_class(cls)
        except SystemDefinitionError as error:
            message = SystemDefinitionError(f"{error} (class {cls.__name__}, {defined_at(cls.__module__)})")
            if cls.__module__ not in REFUSED:
                raise message from None
            REFUSED[cls.__module__][cls] = message  # reported when the system is loaded: other classes of the file may be used


def _check_class(cls: type[ImpactSystem]) -> None:
    if "rebound" not in vars(cls) and cls.rebound is ImpactSystem.rebound and "r" not in cls.model_fields:
        raise SystemDefinitionError(
            f"{cls.__name__} has no parameter r for Newton's restitution; expected: a field `r: float`, or a method `rebound`"
        )
    if "sympy" in sys.modules:
        from nsmaps.exact.flows.formulas import check_definition

        check_definition(cls)


@fingerprint.register
def _(system: ImpactSystem) -> str:
    """The identity of a system includes its formulas, which its class may have changed."""
    return f"{system._kernel().name}({system!r})"
