"""What the class of an impact system states: its walls, its forcing, its flight and its impact law."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar, Literal

from nsmaps.coordinates import Angle, Coordinates
from nsmaps.errors import NsmapsError, SystemDefinitionError
from nsmaps.exact.systems.guards import Guard, HybridFormulas, PoincareSection

FLIGHT = "flight"  #: the mode between impacts


@dataclass(frozen=True, slots=True)
class Wall:
    """A wall, as in `ImpactSystem.walls`: `{"B": Wall(at=0, side=-1)}` for a floor.

    Args:
        at: its displacement, a number or a formula in the parameters.
        side: +1 stops growing displacement (the ball is below), -1 falling displacement.
        ends: whether the motion ends there, with the outcome `escaped`.
    """

    at: Any
    side: Literal[-1, 1]
    ends: bool = False


class ImpactFormulas(HybridFormulas):
    """The formulas of an impact system, from which `ImpactSystem` derives the map: in `self`, with numbers or symbols in it.

    They are those of a system with one mode, `flight`, and with contact that lasts on each wall. Its states are the displacement
    `place` and the velocity `v` towards the base wall, which is the impact speed there.
    """

    coordinates: ClassVar[Coordinates] = Coordinates(("v", Angle("phi")))
    states: ClassVar[tuple[str, ...]] = ("place", "v")
    noise: ClassVar[str] = "noise"  #: added to the acceleration

    @abstractmethod
    def walls(self) -> Mapping[str, Wall]:
        """The walls by their letter in impact words; the first is the base wall. There is at most one on each side."""

    @abstractmethod
    def period(self) -> Any:
        """Period of the forcing, in the system's time."""

    @abstractmethod
    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        """Displacement at time t after the impact `hit`, whose time, place and velocity just after are hit.t, hit.z, hit.w."""

    def acceleration(self, t: Any, place: Any, velocity: Any) -> Any:
        """The right-hand side of the equation of motion between impacts, in place of a `displacement` that is not known.

        A class that has both is followed by its displacement.
        """
        raise SystemDefinitionError(f"{type(self).__name__} is given by its displacement; expected: an `acceleration`")

    @classmethod
    def flight(cls) -> str:
        """The formula that gives the flights: "displacement", or "acceleration" where they are integrated."""
        return "acceleration" if cls.displacement is _no_closed_form else "displacement"

    def _force(self, t: Any, place: Any, velocity: Any) -> Any:
        """The acceleration between impacts as a formula of sympy: as given, or that with which a flight begins."""
        if self.flight() == "acceleration":
            return self.acceleration(t, place, velocity)
        from sympy import Dummy, diff

        s = Dummy()
        return diff(self.displacement(t + s, SimpleNamespace(t=t, z=place, w=velocity)), s, 2).subs(s, 0)

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Flight between the walls."""
        side = self._base.side
        return {FLIGHT: {"place": side * y.v, "v": side * (self._force(t, y.place, side * y.v) + y.noise)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """An impact with each wall, on which the ball rests where the impact law leaves no speed of none."""
        return {letter: self._impact(letter, wall, y) for letter, wall in self.walls().items()}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Just before an impact with the base wall."""
        return PoincareSection(self.section_letters, self.coordinates)

    def _impact(self, letter: str, wall: Wall, y: SimpleNamespace) -> Guard:
        onto = wall.side * self._base.side  #: velocities v towards the wall have this sign
        reset = {"v": -onto * self.rebound(onto * y.v, letter)}
        rests = "" if wall.ends or self.rebound(0, letter) != 0 else f"rest on {letter}"
        return Guard(FLIGHT, wall.side * (wall.at - y.place), reset=reset, letter=letter, ends=wall.ends, rests=rests)

    @property
    def _base(self) -> Wall:
        return next(iter(self.walls().values()))

    def obstacle(self) -> str:
        """Why first returns are not those of flights in closed form that impacts alone end, or no text."""
        if self.flight() == "acceleration":
            return "is given by its acceleration"
        ends = (letter for letter, wall in self.walls().items() if wall.ends)
        return next((f"has the wall {letter!r}, at which motions end" for letter in ends), "")

    def _reversal(self) -> Sequence[float]:
        base, *_ = self.letters
        return float(self.rebound(1.0, base)), -1.0

    def rebound(self, speed: Any, wall: str) -> Any:
        """Speed just after an impact of `speed` on `wall`: Newton's restitution, eq. eq_impact, unless a system has its own."""
        return self.r * speed  # type: ignore[attr-defined]

    def absolute(self, t: Any, displacement: Any) -> Any:
        """Place relative to an observer at rest, for figures, at this displacement and time t of the forcing, in arrays.

        It equals the displacement unless a system defines the motion of its walls.
        """
        return displacement

    @classmethod
    def formulas(cls) -> dict[str, Any]:
        """The formulas of the class by name, all that its flights and impacts follow from."""
        return {name: getattr(cls, name) for name in ("walls", "period", "displacement", "acceleration", "rebound")}

    @property
    def letters(self) -> tuple[str, ...]:
        """The names of the walls, of which words consist, the base wall first."""
        return tuple(self.walls())

    @property
    def section_letters(self) -> tuple[str, ...]:
        """The letters with which words begin: the base wall."""
        return self.letters[:1]

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Let a class that states an acceleration, but no displacement, have none in closed form."""
        super().__init_subclass__(**kwargs)
        if "acceleration" in vars(cls) and "displacement" not in vars(cls):
            cls.displacement = _no_closed_form  # type: ignore[method-assign, assignment]


def _no_closed_form(system: ImpactFormulas, t: Any, hit: SimpleNamespace) -> Any:
    """The displacement of a system that is given by its acceleration."""
    raise NsmapsError(f"{type(system).__name__} is given by its acceleration; expected: a `displacement`")
