"""The base of impact systems and systems with modes: systems whose returns are those of motions in time."""

from abc import abstractmethod
from typing import Any, ClassVar

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.exact.enclosure.images import BoxImages
from nsmaps.exact.returnmap import ExactMap
from nsmaps.exact.returns import Itineraries, Returns
from nsmaps.exact.systems.parameters import System


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

    @abstractmethod
    def extents(self, states: ArrayLike) -> Floats:
        """The largest extent of each coordinate on a flight between events of first returns, shape (n,)."""

    @abstractmethod
    def image_boxes(self, boxes: ArrayLike) -> BoxImages:
        """Boxes that contain the images of all states of each box, rounding errors included: an enclosure of the map."""

    @abstractmethod
    def trajectory(self, state: ArrayLike, n: int, samples: int = 50) -> tuple[Any, Any]:
        """Times and states along the flights between the first n events from `state`, with `samples` points per flight."""
