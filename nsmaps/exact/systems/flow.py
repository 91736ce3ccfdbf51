"""The base of impact systems and systems with modes: systems whose returns are those of motions in time."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, cast

from nsmaps.arrays import ArrayLike, Floats
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

    @abstractmethod
    def orbits(self, states: ArrayLike, n: int, derivative: bool = False) -> Returns:
        """The first n returns of each of M states: n M rows, the first return of every state first."""

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
