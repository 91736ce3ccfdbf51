"""What the class of an impact system states: its walls, its forcing, its flight and its impact law."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar, Literal

from nsmaps.coordinates import TWO_PI, Angle, Coordinates
from nsmaps.errors import NsmapsError, SystemDefinitionError
from nsmaps.exact.systems.flow import FlowSystem


@dataclass(frozen=True, slots=True)
class Wall:
    """A wall at displacement `at`: side +1 stops growing displacement (the ball is below), side -1 falling displacement."""

    at: Any
    side: Literal[-1, 1]


class ImpactFormulas(FlowSystem):
    """The formulas of an impact system, from which `ImpactSystem` derives the map: in `self`, with numbers or symbols in it."""

    coordinates: ClassVar[Coordinates] = Coordinates(("v", Angle("phi")))

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
        raise SystemDefinitionError(f"{type(self).__name__} is given by its displacement and has no acceleration")

    @classmethod
    def flight(cls) -> str:
        """The formula that gives the flights: "displacement", or "acceleration" where they are integrated."""
        return "acceleration" if cls.displacement is _no_closed_form else "displacement"

    def rebound(self, speed: Any, wall: str) -> Any:
        """Speed just after an impact of `speed` on `wall`: Newton's restitution, eq. eq_impact, unless a system has its own."""
        return self.r * speed  # type: ignore[attr-defined]

    def absolute(self, t: Any, displacement: Any) -> Any:
        """Place relative to an observer at rest, for figures of the motion, at this displacement and time t of the forcing, in
        arrays.

        It equals the displacement unless a system defines the motion of its walls.
        """
        return displacement

    @property
    def letters(self) -> tuple[str, ...]:
        """The names of the walls, of which words consist, the base wall first."""
        return tuple(self.walls())

    @property
    def section_letters(self) -> tuple[str, ...]:
        """The letters with which words begin: the base wall."""
        return self.letters[:1]

    def phase_rate(self) -> float:
        """Radians of phase per unit of the system's time."""
        return TWO_PI / float(self.period())

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Let a class that states an acceleration, but no displacement, have none in closed form."""
        super().__init_subclass__(**kwargs)
        if "acceleration" in vars(cls) and "displacement" not in vars(cls):
            cls.displacement = _no_closed_form  # type: ignore[method-assign, assignment]
        cls.map_name = "integrated map" if cls.flight() == "acceleration" else "exact map"


def _no_closed_form(system: ImpactFormulas, t: Any, hit: SimpleNamespace) -> Any:
    """The displacement of a system that is given by its acceleration."""
    raise NsmapsError(f"{type(system).__name__} is given by its acceleration, and its displacement is not known in closed form")
