"""What impact systems and systems with modes inherit: the methods of maps whose returns are those of motions in time."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import StateLike, as_states
from nsmaps.exact.batches import divided_returns
from nsmaps.exact.chatter import SUMMED_SPEED, check_chatter
from nsmaps.exact.enclosure.images import BoxImages
from nsmaps.exact.kernel import MotionKernel
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Itineraries, Returns
from nsmaps.exact.systems.files import check_period
from nsmaps.exact.systems.guards import HybridFormulas
from nsmaps.parallel import SERIAL, Parallel

if TYPE_CHECKING:
    from nsmaps.exact.events import Arrivals, ModeTrack, Track


class FlowSystem(HybridFormulas):
    """A system whose returns are those of motions in time, from event to event."""

    wanted: ClassVar[str] = "an ImpactSystem or a HybridSystem: other maps have no motion between their returns"

    if TYPE_CHECKING:

        def _kernel(self) -> MotionKernel: ...

    def _compile(self) -> MotionKernel:
        values = ", ".join(f"{name} = {value:g}" for name, value in self.parameters.items())
        check_period(type(self), self.period(), f" at {values}")
        return _kernel(self.definition_key(), repr(vars(self)), _Unkeyed(self))

    @property
    @abstractmethod
    def section_letters(self) -> tuple[str, ...]:
        """The letters with which words begin."""

    def first_return(
        self,
        states: ArrayLike,
        derivative: bool = False,
        chatter: float = SUMMED_SPEED,
        margin: bool = False,
        parallel: Parallel = SERIAL,
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
            margin: also compute the distance of each return from a graze, by a second pass, here.
            parallel: see `nsmaps.Parallel`; a part is 20,000 states.

        Raises:
            StateError: `states` is not a batch of shape (N, n), or `chatter` is below zero.
            Interrupted: Ctrl-C; `result` has the returns of the first states, up to a part that was not finished.
        """
        if parallel.divided and not margin:
            return divided_returns(self, states, 1, derivative, parallel=parallel, chatter=chatter)
        kernel, share = self._kernel(), check_chatter(chatter)
        start = as_states(states, kernel.coordinates)
        returns = kernel.first_returns(start, derivative, share)
        return replace(returns, margin=kernel.itineraries(start, share).margin) if margin else returns

    def orbits(
        self,
        states: ArrayLike,
        n_returns: int,
        derivative: bool = False,
        chatter: float = SUMMED_SPEED,
        parallel: Parallel = SERIAL,
    ) -> Returns:
        """The first returns of each of M states, on one core: `n_returns` M rows, the first return of every state first.

        After an orbit's end its images are NaN, its words empty, and the outcome that ended it is repeated.
        Other arguments and errors as `first_return`.
        """
        if parallel.divided:
            return divided_returns(self, states, n_returns, derivative, parallel=parallel, chatter=chatter)
        kernel = self._kernel()
        return kernel.orbits(as_states(states, kernel.coordinates), n_returns, derivative, check_chatter(chatter))

    def sensitivity(self, states: ArrayLike, rates: Mapping[str, float], chatter: float = SUMMED_SPEED) -> Floats:
        """The derivative of first returns by the parameters, which change at the `rates` given, shape (N, n).

        It is carried through every event, as `derivative` of `first_return`; NaN where there is no return, and of flights in
        closed form where it rests or chatters. Other arguments and errors as `first_return`; ParameterError for a name that no
        numerical parameter has.
        """
        start = as_states(states, self.coordinates)
        return self._kernel().sensitivities(start, self.direction(rates), check_chatter(chatter))

    def itineraries(self, states: ArrayLike, speeds: Floats | None = None, chatter: float = SUMMED_SPEED) -> Itineraries:
        """What the flights of first returns pass, `v` in itineraries, and how near they come to a graze.

        Of an impact system these are turning points, of others minima of guards. `clearance` is the least gap to a wall, or value
        of a guard's function, at such a point, `slowest` the least impact speed, or rate of a function at its event. Two returns
        with the same itinerary lie on one smooth piece of the map; pieces end where either is zero. Arguments and errors as
        `first_return`.

        Args:
            states: shape (N, n).
            speeds: of a system with modes those of `guard_speeds`, of which both are shares: gaps in units of time then, rates
                without one. Without these they are in the units of the guards' functions, which need not be the same.
        """
        return self._kernel().itineraries(as_states(states, self.coordinates), check_chatter(chatter), speeds)

    def reasons(self, states: ArrayLike, chatter: float = SUMMED_SPEED) -> tuple[str, ...]:
        """Why each first return ended, a sentence each: which wall or guard, when and where, and what is wrong with a start.

        Arguments and errors as `first_return`.
        """
        return self._kernel().reasons(as_states(states, self.coordinates), check_chatter(chatter))

    def arrivals(self, states: ArrayLike, modes: str | Sequence[str] | None = None, derivative: bool = False) -> "Arrivals":
        """Where motions from states anywhere in a mode first come to the section.

        Args:
            states: shape (N, k), all states in their order and, with forcing, the phase in radians on any turn as the last. Those
                of an impact system are the displacement `place` and the velocity `v` towards the base wall.
            modes: the mode of all of them, or of each. Without, each starts in the first mode, in the order of the class, whose
                guards are positive there; sliding and contact that lasts must be given, of a state on their surface. Those of an
                impact system are `flight` and, for contact, `rest on B` on a wall B.
            derivative: also the derivative of the images by `states`, shape (N, m, k), through every event.

        There is no `chatter`: a motion has come to the section with the first impact there, and others are summed as always.
        A state that violates a guard of its mode, or that belongs to none, has no image: outcome `invalid`. On a surface from
        which both modes lead away the motion is not unique: outcome `repelling`.

        Raises:
            StateError: `states` is not a batch of this shape, there are not as many modes, one is unknown, or a state in sliding
                or in contact that lasts does not lie on its surface.
        """
        return self._kernel().modes.arrivals(states, modes, derivative)

    def arrival_reasons(self, states: ArrayLike, modes: str | Sequence[str] | None = None) -> tuple[str, ...]:
        """Why each motion of `arrivals` ended, a sentence each, as `reasons`. Arguments and errors as `arrivals`."""
        return tuple(self._kernel().modes.arrival_reasons(states, modes))

    def inverse(self) -> ReturnMap:
        """The inverse of the map, on all images of states that neither rest nor chatter completely.

        Errors as `reversed_system`.
        """
        from nsmaps.exact.systems.reversed import InverseMap, reversed_system

        return InverseMap(self, reversed_system(self))

    @abstractmethod
    def extents(self, states: ArrayLike) -> Floats:
        """The largest extent of each coordinate on a flight between events of first returns, shape (n,)."""

    @abstractmethod
    def image_boxes(self, boxes: ArrayLike) -> BoxImages:
        """Boxes that contain the images of all states of each box, rounding errors included: an enclosure of the map."""

    @abstractmethod
    def trajectory(self, state: StateLike, n: int, samples: int = 50) -> tuple[Any, Any]:
        """Times and states along the flights between the first n events from `state`, with `samples` points per flight."""

    @abstractmethod
    def _track(self, state: StateLike, n: int, samples: int, chatter: float) -> "Track | ModeTrack":
        """As `nsmaps.exact.trajectory.track`."""

    def _check(self) -> None:
        """Refuse formulas of the class from which its definition with modes would be derived."""


class _Unkeyed:
    """An argument that `lru_cache` ignores: all objects of this class are equal."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other)

    def __hash__(self) -> int:
        return 0


@lru_cache(maxsize=256)
def _kernel(cls: tuple[Any, ...], values: str, system: _Unkeyed) -> MotionKernel:
    """The kernel whose flights fit a system, in the one place where it is chosen; those that were used last are kept.

    Closed forms are the fastest, and are taken where nothing is in their way; the definition with modes follows any motion.
    """
    if not system.value.obstacle():
        from nsmaps.exact.engine.kernel import SpectralKernel

        return SpectralKernel.of(system.value)
    from nsmaps.exact.modes.kernel import ModeKernel

    system.value._check()
    return ModeKernel.of(system.value)
