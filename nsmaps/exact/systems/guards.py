"""What the class of a system with modes states: guards, surfaces along which motions slide, the section, and its formulas."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, ClassVar, Literal

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.systems.parameters import ExactSystem

HORIZON = 1000.0  #: far beyond the flights of motions that return, and soon reached by those that do not


@dataclass(frozen=True, slots=True)
class Guard:
    """An event: a function of the state that falls through zero in one or several modes, and what happens then.

    A guard is an *invariant* of its modes unless it is a *crossing*: its function is positive for as long as the mode lasts, and
    a motion that comes to such a mode where it is negative is `blocked`. A crossing takes place whenever its function falls
    through zero, whatever its sign where the mode begins, and not again before it has risen. What depends on the time alone, as
    a clock, is a crossing, and so are guards at which nothing changes, neither mode nor states.

    Of guards with the same function in the same mode the first whose conditions hold takes place. In `HybridSystem.guards` an
    impact of restitution r on a floor is `{"B": Guard("flight", y.x, reset={"v": -self.r * y.v})}`.

    Args:
        modes: in which it is watched, one or several.
        function: any smooth formula of the states and of the time; positive before the event.
        to: the mode that follows; "" for the same.
        reset: states just after the event, by the states just before and the time; the others stay.
        where: such functions that must not be negative for the event to take place.
        letter: in words; None for the first letter of the guard's name, "" for none.
        ends: whether the motion ends here, with the outcome `escaped`.
        crossing: whether the function may be negative in its modes.
        rests: a name for the mode of lasting contact, which is derived where the reset is an impact; "" without one.
    """

    modes: str | Sequence[str]
    function: Any
    to: str = ""
    reset: Mapping[str, Any] = field(default_factory=dict)
    where: Sequence[Any] = ()
    letter: str | None = None
    ends: bool = False
    crossing: bool = False
    rests: str = ""

    @property
    def watched(self) -> tuple[str, ...]:
        """The modes in which it is watched."""
        return (self.modes,) if isinstance(self.modes, str) else tuple(self.modes)


@dataclass(frozen=True, slots=True)
class SlidingSurface:
    """A surface between two modes: crossed where one of them leads away from it, and where both lead to it, the motion slides.

    Its name among the guards is that of the mode in which the motion slides, which follows from the rates of both (Filippov). It
    lasts until one of the two no longer leads to the surface. Events are named by the modes before and after, "slip to stick".

    Args:
        above: the mode where the function is positive.
        below: the mode where it is negative.
        function: any smooth formula of the states and of the time.
        letters: of events by the mode that follows; its first letter unless given.
    """

    above: str
    below: str
    function: Any
    letters: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PoincareSection:
    """The events between which the return map leads, and the coordinates there, as `PoincareSection("B", ("v", "phi"))`.

    Args:
        guards: names of the events, one or several.
        coordinates: names of states, and with forcing a name of its own for the phase, radians.
        side: of the reset, "before" or "after", on which starts and images are.
        states: the other states by the coordinates, but one that the guard gives.
    """

    guards: str | Sequence[str]
    coordinates: Sequence[str]
    side: Literal["before", "after"] = "before"
    states: Mapping[str, Any] = field(default_factory=dict)


class HybridFormulas(ExactSystem):
    """The formulas of a system with modes, from which `HybridSystem` derives the map: in `self`, the time and the states."""

    states: ClassVar[tuple[str, ...]] = ()
    horizon: ClassVar[float] = HORIZON  #: longest flight between two events, in periods of the forcing or units of time
    noise: ClassVar[str] = ""  #: name of the noise in formulas, as y.eta for "eta", zero where none is added; "" without noise

    def period(self) -> Any:
        """Period of the forcing, in the system's time; None where there is no forcing."""
        return None

    @abstractmethod
    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """The rates of all states in each mode, by the names of modes and states."""

    @abstractmethod
    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        """The events by their names, and surfaces by the names of the modes that slide along them."""

    @abstractmethod
    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Where the return map is taken."""

    def phase_rate(self) -> float:
        """Radians of phase a unit of the system's time; zero without forcing."""
        period = self.period()
        return 0.0 if period is None else TWO_PI / float(period)

    def obstacle(self) -> str:
        """Why first returns are not those of flights in closed form that impacts alone end, or no text."""
        return "is a system with modes"

    @abstractmethod
    def _reversed_class(self) -> "type[HybridFormulas]":
        """The class in reversed time; NsmapsError where a motion has no past."""

    @abstractmethod
    def _reversal(self) -> Sequence[float]:
        """By what each coordinate of a state is multiplied in the reversed system."""

    @classmethod
    def formulas(cls) -> dict[str, Any]:
        """The formulas of the class by name, all that its motions follow from."""
        return {name: getattr(cls, name) for name in ("period", "modes", "guards", "section")}

    @classmethod
    def definition_key(cls) -> tuple[Any, ...]:
        """All of the class that its motions depend on."""
        return cls, cls.horizon, cls.noise, *cls.formulas().values()

    @classmethod
    def _arguments(cls, states: Mapping[str, Any]) -> SimpleNamespace:
        """What formulas take as y: states by name, and the noise, zero unless it is among them."""
        return SimpleNamespace(**{**({cls.noise: 0} if cls.noise else {}), **states})
