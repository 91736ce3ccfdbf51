"""A system with modes, written once: rates, guards and resets in sympy; its return map follows from them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import Coordinates, StateLike, as_starts, as_states
from nsmaps.errors import MissingMethodError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.guards import Guard as Guard
from nsmaps.exact.systems.guards import HybridFormulas
from nsmaps.exact.systems.guards import PoincareSection as PoincareSection
from nsmaps.exact.systems.guards import SlidingSurface as SlidingSurface

if TYPE_CHECKING:
    from nsmaps.exact.enclosure.images import BoxImages
    from nsmaps.exact.events import ModeTrack
    from nsmaps.exact.modes.definitions.definition import Definition


#: methods of impact systems -> what systems with modes have instead
INSTEAD = {"impacts": "nsmaps.track(system, start, n_events)", "grazing_curves": "nsmaps.dynamics.graze(system, one, other)"}


class HybridSystem(FlowSystem):
    """A system whose state follows differential equations that change at events.

    Subclass it: the fields are the parameters, `states` the names of the states, and `modes`, `guards` and `section` are formulas
    in `self`, in the time t and in the states y.x, y.v, ..., which sympy symbols stand for. They are any smooth formulas, and may
    have kinks, as Abs and Max. Where rates and guards are affine in the states, with harmonics of the forcing, flights are
    series of nsmaps, otherwise heyoka's (the extra `ode`). A state of the return map is a row of the section's coordinates.
    """

    if not TYPE_CHECKING:  # a type checker reports unknown attributes itself

        def __getattr__(self, name: str) -> Any:
            if name in INSTEAD:
                text = f"{name!r} of {type(self).__name__}, a system with modes, is not there; expected: {INSTEAD[name]}"
                raise MissingMethodError(text)
            return super().__getattr__(name)

    @property
    def coordinates(self) -> Coordinates:
        """The names of the coordinates of the return map, the phase of the forcing an `Angle`."""
        return self._definition().coordinates

    @property
    def letters(self) -> tuple[str, ...]:
        """The letters of events, of which words consist."""
        return self._definition().letters

    @property
    def section_letters(self) -> tuple[str, ...]:
        """The letters with which words begin, those of the section's events; "" for an event without one."""
        return self._definition().alphabet.section or ()

    def guard_speeds(self, states: ArrayLike, between: bool = False) -> Floats:
        """The largest rate of change of the function of each guard just before the events of first returns, or `between` too.

        At an impact with a wall it is the largest impact speed. A number for each guard in each of its modes, in a fixed order.

        Raises:
            StateError: `states` is not a batch of shape (N, n), or one is not a start.
        """
        return self._kernel().modes.guard_speeds(as_states(states, self.coordinates), between)

    def on_section(self, states: ArrayLike) -> Floats:
        """States of the section nearest to some, shape (N, n), where its coordinates are not all free; otherwise the same.

        Of a state off the surface of the section, which is not a start, the coordinates that are states are moved onto the
        nearest surface, each in proportion to its size; a phase is kept.

        Raises:
            StateError: `states` is not a batch of shape (N, n).
        """
        return self._kernel().modes.on_section(as_states(states, self.coordinates))

    def extents(self, states: ArrayLike) -> Floats:
        """The largest extent of each coordinate on a flight between events of first returns, shape (n,).

        It is zero of a phase, and of a state that only resets change.

        Raises:
            StateError: `states` is not a batch of shape (N, n), or one is not a start.
        """
        return self._kernel().modes.extents(as_states(states, self.coordinates))

    def rests(self, states: ArrayLike) -> Floats:
        """The shortest contact after chatter or rest that begins and is released within each first return, shape (N,).

        In radians of phase, without forcing in units of time; NaN without such contact, and of a state without a return.

        Raises:
            StateError: `states` is not a batch of shape (N, n).
        """
        return self._kernel().modes.rests(as_states(states, self.coordinates)) * (self.phase_rate() or 1.0)

    def image_boxes(self, boxes: ArrayLike) -> "BoxImages":
        """Boxes that contain the images of all states of each box, rounding errors included: an enclosure of the map.

        Args:
            boxes: shape (N, n, 2), lower and upper end of each of the section's coordinates (phases in radians, any turn).

        Raises:
            StateError: `boxes` is not a batch of finite boxes.
            ProofError: rates, guards or a reset are not affine, or contact lasts (`rests`).
        """
        from nsmaps.exact.modes.enclosure.images import image_boxes

        return image_boxes(self, boxes)

    def trajectory(self, start: StateLike, n_events: int, n_samples: int = 50) -> tuple[Floats, Floats]:
        """Times and states along the flights between the first events from `start`, with `n_samples` points per flight.

        Arrays of shape (T,) and (T, number of states) in the system's units, through sliding and lasting contact too. For modes
        and events see `nsmaps.exact.trajectory.track`, which also states what is a start and which errors are raised.
        """
        track = self._track(start, n_events, n_samples, SUMMED_SPEED)
        return track.time.ravel(), track.states.reshape(-1, len(self.states))

    def _track(self, state: StateLike, n: int, samples: int, chatter: float) -> "ModeTrack":
        """As `nsmaps.exact.trajectory.track`."""
        return self._kernel().modes.track(as_starts(state, self.coordinates), n, samples, chatter)

    def _reversed_class(self) -> type[HybridFormulas]:
        from nsmaps.exact.systems.reversed import reversed_modes, signs_of

        return reversed_modes(type(self), signs_of(self, self._definition()))

    def _reversal(self) -> Sequence[float]:
        return tuple(np.where(self.coordinates.angles, -1.0, 1.0).tolist())

    def _definition(self) -> "Definition":
        """The formulas of the class, for all values of its parameters."""
        from nsmaps.exact.modes.kernel import known_definition

        return self._once("definition", lambda: known_definition(self))
