"""Systems in reversed time, whose first returns lead back along the orbits of the systems, and the inverses of their maps.

At an event the states before and after it change places, and phases run backwards. A state (v, phi) of an impact system, with the
speed u after the impact, is the state (u, -phi) of the reversed one. The section of a system with modes lies on the other side of
the reset, so that its states are the same, at the phase -phi.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI, Coordinates, as_states
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.guards import Guard, Section
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.system import ImpactSystem

if TYPE_CHECKING:
    from nsmaps.exact.modes.definitions.definition import Transition

SAME = 1e-9  #: relative difference of rows that are proportional
Signs = tuple[tuple[str, int], ...]  #: of each guard, by name: whether its function is positive or negative just after its event


@dataclass(frozen=True, slots=True)
class InverseMap(ReturnMap):
    """The inverse of the map of a system, on all images of states that neither rest nor chatter completely."""

    system: FlowSystem
    back: FlowSystem  #: the system in reversed time

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the system."""
        return self.system.coordinates

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """The preimages of states of shape (N, n), as images; words are those in reversed time, times positive."""
        start, factors = as_states(states, self.coordinates), factors_of(self.system)
        found = self.back.first_return(start * factors, derivative)
        lifted = found.lifted / factors
        image = self.coordinates.wrap(lifted)
        turns = np.where(np.isfinite(image), np.rint((lifted - image) / TWO_PI), 0.0) * self.coordinates.angles
        slopes = None if found.derivative is None else found.derivative * factors / factors[:, None]
        return replace(found, start=start, image=image, turns=turns.astype(np.int32), derivative=slopes)


def inverse_map(system: FlowSystem) -> InverseMap:
    """The inverse of the map of a system, by the system in reversed time. Raises as `reversed_system`."""
    return InverseMap(system, reversed_system(system))


def reversed_system(system: FlowSystem) -> FlowSystem:
    """The system in reversed time.

    Its first return is the inverse of the system's on all images of states that neither rest nor chatter completely, for then
    every event and every flight has one past.

    Raises:
        NsmapsError: flights are integrated or nonlinear, modes slide, an impact law or a reset cannot be inverted, or an event
            does not determine the mode before it.
    """
    cls = type(system)
    if isinstance(system, HybridSystem):
        cls = _modes_class(cls, signs_of(system))
    elif isinstance(system, ImpactSystem):
        _check_impacts(system)
        cls = _class(cls)
    return cls.model_construct(**{name: getattr(system, name) for name in cls.model_fields})


def _check_impacts(system: ImpactSystem) -> None:
    """Refuse an impact system whose impacts or flights have no past."""
    from nsmaps.exact.flows.formulas import is_linear
    from nsmaps.exact.flows.tables import formulas_of

    name = type(system).__name__
    if system.flight() == "acceleration":
        raise NsmapsError(f"{name} in reversed time: its flights are integrated; expected: a displacement in closed form")
    if not all(is_linear(law) for law in formulas_of(system).laws):
        raise NsmapsError(f"{name} in reversed time: an impact law is not linear in the speed; expected: a restitution")
    if lost := [wall for wall in system.letters if not restitution(system, wall) > 0]:
        raise NsmapsError(f"{name} in reversed time: an impact on {lost[0]} leaves no speed; expected: a restitution above 0")


def restitution(system: ImpactSystem, wall: str) -> float:
    """The speed after an impact of speed one."""
    return float(system.rebound(1.0, wall))


def factors_of(system: FlowSystem) -> Floats:
    """By what each coordinate of a state is multiplied in the reversed system, shape (n,)."""
    factors = np.where(system.coordinates.angles, -1.0, 1.0)
    if isinstance(system, ImpactSystem):
        factors[0] = restitution(system, system.letters[0])
    return factors


def to_reversed(system: FlowSystem, states: Floats) -> Floats:
    """States (N, n) of a system as states of the reversed one."""
    return np.asarray(states * factors_of(system))


def of_reversed(system: FlowSystem, states: Floats) -> Floats:
    """States (N, n) of the reversed system as states of the system."""
    return np.asarray(states / factors_of(system))


@lru_cache(maxsize=64)
def _class(cls: type[ImpactSystem]) -> type[ImpactSystem]:
    """The class of an impact system in reversed time."""

    def displacement(self: Any, t: Any, hit: SimpleNamespace) -> Any:
        return cls.displacement(self, -t, SimpleNamespace(t=-hit.t, z=hit.z, w=-hit.w))

    def rebound(self: Any, speed: Any, wall: str) -> Any:
        return speed / cls.rebound(self, 1, wall)

    body = {"displacement": displacement, "rebound": rebound, "__module__": __name__, "__qualname__": f"Reversed{cls.__name__}"}
    return type(f"Reversed{cls.__name__}", (cls,), body)


@lru_cache(maxsize=64)
def _modes_class(cls: type[HybridSystem], signs: Signs) -> type[HybridSystem]:
    """The class of a system with modes in reversed time.

    The event of a guard g with the reset R, from the mode m to m', is that of s g(R^-1) with the reset R^-1, from m' to m, where
    s g(R^-1) is positive just after the event. A motion that leaves its mode otherwise has no past.
    """
    known = dict(signs)

    def modes(self: Any, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        given = cls.modes(self, -t, y)
        return {mode: {state: -rate for state, rate in rates.items()} for mode, rates in given.items()}

    def guards(self: Any, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        given, found = {name: one for name, one in cls.guards(self, -t, y).items() if isinstance(one, Guard)}, {}
        for name, one in given.items():
            if name in known:
                found[name] = _reversed_guard(name, one, known[name], {state: getattr(y, state) for state in cls.states})
        for name, one in given.items():
            if one.ends or (name in known and known[name] > 0):
                found[f"{name} without past"] = replace(one, to="", reset={}, where=(), letter="", ends=True, rests="")
        return found

    def section(self: Any, t: Any, y: SimpleNamespace) -> Section:
        given = cls.section(self, -t, y)
        return replace(given, side="after" if given.side == "before" else "before")

    body = {"modes": modes, "guards": guards, "section": section, "__module__": __name__}
    return type(f"Reversed{cls.__name__}", (cls,), {**body, "__qualname__": f"Reversed{cls.__name__}"})


def _reversed_guard(name: str, guard: Guard, sign: int, states: Mapping[str, Any]) -> Guard:
    """The guard of an event in reversed time."""
    from sympy import Matrix, cancel, sympify

    after = Matrix([sympify(guard.reset.get(state, y)) for state, y in states.items()])
    own = Matrix(list(states.values()))
    slopes, at_zero = after.jacobian(own), after.subs(dict.fromkeys(own, 0))
    before = dict(zip(own, (slopes.inv() * (own - at_zero)).applyfunc(cancel), strict=True))

    def earlier(formula: Any) -> Any:
        return sympify(formula).subs(before, simultaneous=True)

    return replace(
        guard,
        modes=guard.to or guard.modes,
        to=guard.watched[0] if guard.to else "",
        function=sign * earlier(guard.function),
        reset={state: before[y] for state, y in states.items() if before[y] != y},
        where=tuple(map(earlier, guard.where)),
        letter=name[0] if guard.letter is None else guard.letter,
        rests="",
    )


def signs_of(system: HybridSystem) -> Signs:
    """The sign of each guard's function just after its event, by the states just before it.

    The function's rate after it is a multiple of that before, which is negative.

    Raises:
        NsmapsError: as `reversed_system`.
    """
    what = f"{type(system).__name__} in reversed time"
    kernel = system._kernel()
    definition, p = kernel.definition, kernel.table
    if definition.smooth:
        raise NsmapsError(f"{what}: its modes are nonlinear; expected: rates that are affine in the states")
    if definition.surfaces:
        raise NsmapsError(f"{what}: all motions that slide along {definition.surfaces[0].name!r} have one future; expected: none")
    signs: dict[str, int] = {}
    passed: dict[tuple[str, ...], str] = {}
    for number, one in _events(definition.transitions):
        before, after = definition.modes[one.mode], definition.modes[one.target]
        sign, row = _after_event(what, p, number, one)
        if signs.setdefault(one.name, sign) != sign:
            raise NsmapsError(f"{what}: the guard {one.name!r} is on either side of its surface after its event")
        key = after, *(f"{x:.9e}" for x in row / np.abs(row).max())
        if not one.where and passed.setdefault(key, before) != before:
            raise NsmapsError(
                f"{what}: the guard {one.name!r} leads to the mode {after!r} from {before!r}, as another event does from "
                f"{passed[key]!r} at the same states: the mode before is not known; expected: one, or conditions (`where`)"
            )
    return tuple(signs.items())


def _events(transitions: "tuple[Transition, ...]") -> "Iterator[tuple[int, Transition]]":
    """The transitions of guards that lead on, with their numbers."""
    for number, one in enumerate(transitions):
        if one.name and one.target >= 0 and not one.releases:
            yield number, one


def _after_event(what: str, p: Any, number: int, one: "Transition") -> tuple[int, Floats]:
    """The sign of a function just after its event, and that function of the states after it, times the sign."""
    from nsmaps.exact.modes.paths.extents import flow_of

    n, width = p.resets.shape[1:]
    reset = np.eye(width)
    reset[:n] = p.resets[number]
    if one.curved:
        raise NsmapsError(f"{what}: the reset of the guard {one.name!r} is not affine in the states; expected: one that is")
    if np.linalg.matrix_rank(reset) < width:
        raise NsmapsError(
            f"{what}: the reset of the guard {one.name!r} takes different states to one, as an impact that leaves no speed; "
            "expected: a reset that can be inverted"
        )
    back, function = np.linalg.inv(reset), p.functions[p.function[number]]
    later, rate = function @ back, function @ flow_of(p, one.mode) @ back
    rate_after = later @ flow_of(p, one.target)
    share = np.linalg.lstsq(np.array([rate, later]).T, rate_after, rcond=None)[0]
    off = np.abs(rate_after - share @ np.array([rate, later])).max()
    if share[0] == 0 or off > SAME * np.abs(rate_after).max():
        raise NsmapsError(
            f"{what}: the function of the guard {one.name!r} may rise or fall after its event, or stay zero; expected: a rate "
            "that is a multiple of that before it"
        )
    sign = -1 if share[0] > 0 else 1
    return sign, sign * later
