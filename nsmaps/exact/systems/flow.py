"""The base of impact systems and systems with modes: systems whose returns are those of motions in time."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, cast

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import as_states
from nsmaps.exact.chatter import SUMMED_SPEED, check_chatter
from nsmaps.exact.enclosure.images import BoxImages
from nsmaps.exact.returnmap import ExactMap
from nsmaps.exact.returns import Itineraries, Returns
from nsmaps.exact.systems.parameters import System

if TYPE_CHECKING:
    from nsmaps.exact.events import Arrivals


class FlowSystem(System, ExactMap):
    """A system whose returns are those of motions in time, from event to event."""

    wanted: ClassVar[str] = "an ImpactSystem or a HybridSystem: other maps have no motion between their returns"
    horizon: ClassVar[float] = 1000.0  #: longest flight between two events, in periods of the forcing or units of time

    @abstractmethod
    def _kernel(self) -> Any:
        """The compiled map at the parameters of the system."""

    @abstractmethod
    def period(self) -> Any:
        """Period of the forcing, in the system's time; None where there is no forcing."""

    @abstractmethod
    def _modes(self) -> Any:
        """The compiled motion between the events of the system's definition, from any state."""

    @property
    @abstractmethod
    def section_letters(self) -> tuple[str, ...]:
        """The letters with which words begin."""

    def first_return(
        self, states: ArrayLike, derivative: bool = False, chatter: float = SUMMED_SPEED, margin: bool = False
    ) -> Returns:
        """The first returns to the section of a batch of states, of an impact system to the base wall, eq. exactmap.

        Args:
            states: shape (N, n), rows of the coordinates in the system's units, phases in radians on any turn; of an impact
                system impact speeds, at least zero, and phases.
            derivative: also the derivative of the image, shape (N, n, n), through every event (saltation matrices).
            chatter: speed of an impact at the section, on the base wall or of a guard that `rests`, as a share of that which the
                acceleration into the surface gives in a radian of the forcing (without one the longest step of a mode), at or
                below which the impacts that follow are summed in one return that ends with the release (word `B~`), once the sum
                is exact to rounding: 0 for every single impact, `inf` for as soon as possible. Impacts off the section are summed
                where that changes a state by less than rounding.
            margin: also compute the distance of each return from a graze, by a second pass.

        Raises:
            StateError: `states` is not a batch of shape (N, n), or `chatter` is below zero.
        """
        start, share = as_states(states, self.coordinates), check_chatter(chatter)
        returns = cast("Returns", self._kernel().first_returns(start, derivative, share))
        return replace(returns, margin=self._kernel().itineraries(start, share).margin) if margin else returns

    def orbits(self, states: ArrayLike, n: int, derivative: bool = False, chatter: float = SUMMED_SPEED) -> Returns:
        """The first n returns of each of M states, on one core: n M rows, the first return of every state first.

        After an orbit's end its images are NaN, its words empty, and the outcome that ended it is repeated.
        Other arguments and errors as `first_return`.
        """
        start, share = as_states(states, self.coordinates), check_chatter(chatter)
        return cast("Returns", self._kernel().orbits(start, n, derivative, share))

    def sensitivity(self, states: ArrayLike, rates: Mapping[str, float], chatter: float = SUMMED_SPEED) -> Floats:
        """The derivative of first returns by the parameters, which change at the `rates` given, shape (N, n).

        It is carried through every event, as `derivative` of `first_return`; NaN where there is no return, and of flights in
        closed form where it rests or chatters. Other arguments and errors as `first_return`; ParameterError for a name that no
        numerical parameter has.
        """
        start, way = as_states(states, self.coordinates), self.direction(rates)
        return cast("Floats", self._kernel().sensitivities(start, way, check_chatter(chatter)))

    @abstractmethod
    def itineraries(self, states: ArrayLike) -> Itineraries:
        """The turning points that the flights of first returns pass, and how near they come to a graze."""

    @abstractmethod
    def reasons(self, states: ArrayLike) -> tuple[str, ...]:
        """Why each first return ended, a sentence each."""

    def arrivals(self, states: ArrayLike, modes: str | Sequence[str] | None = None, derivative: bool = False) -> "Arrivals":
        """Where motions from states anywhere in a mode first come to the section.

        Args:
            states: shape (N, k), all states in their order and, with forcing, the phase in radians on any turn as the last. Those
                of an impact system are the displacement `place` and the velocity `v` towards the base wall.
            modes: the mode of all of them, or of each. Without, each starts in the first mode, in the order of the class, whose
                guards are positive there; sliding and contact that lasts must be given, of a state on their surface. Those of an
                impact system are `flight` and, for contact, `rest on B` on a wall B.
            derivative: also the derivative of the images by `states`, shape (N, m, k), through every event.

        A state that violates a guard of its mode, or that belongs to none, has no image: outcome `invalid`. On a surface from
        which both modes lead away the motion is not unique: outcome `repelling`.

        Raises:
            StateError: `states` is not a batch of this shape, there are not as many modes, one is unknown, or a state in sliding
                or in contact that lasts does not lie on its surface.
        """
        return cast("Arrivals", self._modes().arrivals(states, modes, derivative))

    def arrival_reasons(self, states: ArrayLike, modes: str | Sequence[str] | None = None) -> tuple[str, ...]:
        """Why each motion of `arrivals` ended, a sentence each, as `reasons`. Arguments and errors as `arrivals`."""
        return cast("tuple[str, ...]", self._modes().arrival_reasons(states, modes))

    @abstractmethod
    def extents(self, states: ArrayLike) -> Floats:
        """The largest extent of each coordinate on a flight between events of first returns, shape (n,)."""

    @abstractmethod
    def image_boxes(self, boxes: ArrayLike) -> BoxImages:
        """Boxes that contain the images of all states of each box, rounding errors included: an enclosure of the map."""

    @abstractmethod
    def trajectory(self, state: ArrayLike, n: int, samples: int = 50) -> tuple[Any, Any]:
        """Times and states along the flights between the first n events from `state`, with `samples` points per flight."""
