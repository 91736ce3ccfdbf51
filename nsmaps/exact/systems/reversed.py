"""Systems in reversed time, whose first returns lead back along the orbits of the systems, and the inverses of their maps.

At an event the states before and after it change places, and phases run backwards. A state (v, phi) of an impact system, with the
speed u after the impact, is the state (u, -phi) of the reversed one. The section of a system with modes lies on the other side of
the reset, so that its states are the same, at the phase -phi.
"""

from collections.abc import Mapping, Sequence
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
from nsmaps.exact.systems.guards import Guard, HybridFormulas, PoincareSection
from nsmaps.exact.systems.walls import ImpactFormulas

if TYPE_CHECKING:
    import sympy as sp

    from nsmaps.exact.modes.definitions.definition import Definition, Transition

SAME = 1e-9  #: relative difference of rates that are proportional
SAMPLES = 40  #: states at which they are compared
Signs = tuple[tuple[str, int], ...]  #: of each guard, by name: whether its function is positive or negative just after its event


@dataclass(frozen=True, slots=True)
class InverseMap(ReturnMap):
    """The inverse of the map of a system, on all images of states that neither rest nor chatter completely."""

    system: HybridFormulas
    back: HybridFormulas  #: the system in reversed time

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the system."""
        return self.system.coordinates

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """The preimages of states of shape (N, n), as images; words are those in reversed time, times positive."""
        start, factors = as_states(states, self.coordinates), np.array(self.system._reversal())
        found = self.back.first_return(start * factors, derivative)
        lifted = found.lifted / factors
        image = self.coordinates.wrap(lifted)
        turns = np.where(np.isfinite(image), np.rint((lifted - image) / TWO_PI), 0.0) * self.coordinates.angles
        slopes = None if found.derivative is None else found.derivative * factors / factors[:, None]
        return replace(found, start=start, image=image, turns=turns.astype(np.int32), derivative=slopes)


def reversed_system(system: HybridFormulas) -> HybridFormulas:
    """The system in reversed time.

    Its first return is the inverse of the system's on all images of states that neither rest nor chatter completely, for then
    every event and every flight has one past.

    Raises:
        NsmapsError: modes slide, an impact law or a reset is not affine or cannot be inverted, or an event does not determine
            the mode before it.
    """
    cls = system._reversed_class()
    return cls.model_construct(**{name: getattr(system, name) for name in cls.model_fields})


def reversed_impacts(system: ImpactFormulas) -> type[ImpactFormulas]:
    """The class of an impact system in reversed time. NsmapsError for one whose impacts have no past."""
    from nsmaps.exact.flows.formulas import is_linear
    from nsmaps.exact.flows.tables import formulas_of

    name = type(system).__name__
    if not all(is_linear(law) for law in formulas_of(system).laws):
        raise NsmapsError(f"{name} in reversed time: an impact law is not linear in the speed; expected: a restitution")
    for wall in system.letters:
        if not system.rebound(1.0, wall) > 0:
            raise NsmapsError(f"{name} in reversed time: an impact on {wall} leaves no speed; expected: a restitution above 0")
    return _impacts_class(type(system))


@lru_cache(maxsize=64)
def _impacts_class(cls: type[ImpactFormulas]) -> type[ImpactFormulas]:

    def displacement(self: Any, t: Any, hit: SimpleNamespace) -> Any:
        return cls.displacement(self, -t, SimpleNamespace(t=-hit.t, z=hit.z, w=-hit.w))

    def rebound(self: Any, speed: Any, wall: str) -> Any:
        return speed / cls.rebound(self, 1, wall)

    def acceleration(self: Any, t: Any, place: Any, velocity: Any) -> Any:
        return cls.acceleration(self, -t, place, -velocity)

    flights = {"displacement": displacement} if cls.flight() == "displacement" else {"acceleration": acceleration}
    body = {**flights, "rebound": rebound, "__module__": __name__, "__qualname__": f"Reversed{cls.__name__}"}
    return type(f"Reversed{cls.__name__}", (cls,), body)


@lru_cache(maxsize=64)
def reversed_modes(cls: type[HybridFormulas], signs: Signs) -> type[HybridFormulas]:
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

    def section(self: Any, t: Any, y: SimpleNamespace) -> PoincareSection:
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
        to=next(iter(guard.watched)) if guard.to else "",
        function=sign * earlier(guard.function),
        reset={state: before[y] for state, y in states.items() if before[y] != y},
        where=tuple(map(earlier, guard.where)),
        letter=name[:1] if guard.letter is None else guard.letter,
        rests="",
    )


def signs_of(system: HybridFormulas, definition: "Definition") -> Signs:
    """The sign of each guard's function just after its event, by the states just before it.

    The function's rate after it is a multiple of that before, which is negative.

    Raises:
        NsmapsError: as `reversed_system`.
    """
    what = f"{type(system).__name__} in reversed time"
    for surface in definition.surfaces:
        raise NsmapsError(f"{what}: all motions that slide along {surface.name!r} have one future; expected: none")
    signs: dict[str, int] = {}
    passed: dict[tuple[str, ...], str] = {}
    for one in definition.transitions:
        if not one.name or one.target < 0 or one.releases:
            continue
        before, after = definition.modes[one.mode], definition.modes[one.target]
        sign, values = _after_event(what, definition, one, tuple(system.parameters.values()))
        if signs.setdefault(one.name, sign) != sign:
            raise NsmapsError(f"{what}: the guard {one.name!r} is on both sides of its surface after its event; expected: one")
        key = after, *(f"{x:.9e}" for x in values / np.abs(values).max())
        if not one.where and passed.setdefault(key, before) != before:
            raise NsmapsError(
                f"{what}: the guard {one.name!r} leads to the mode {after!r} from {before!r}, as another event does from "
                f"{passed[key]!r} at the same states: the mode before is not known; expected: one, or conditions (`where`)"
            )
    return tuple(signs.items())


def _affine_reset(what: str, definition: "Definition", one: "Transition") -> Any:
    """The own states after an event, a column of formulas. NsmapsError where they are not affine in those before it."""
    import sympy as sp

    from nsmaps.exact.flows.formulas import PHI

    y = definition.variables
    reset = sp.Matrix([row.of(definition.columns) for row in one.reset[: len(y)]])
    if one.curved or reset.jacobian(y).has(*y, PHI):
        raise NsmapsError(f"{what}: the reset of the guard {one.name!r} is not affine in the states; expected: one that is")
    return reset


def _after_event(what: str, definition: "Definition", one: "Transition", known: tuple[float, ...]) -> tuple[int, Floats]:
    """The sign of a function just after its event, and that function times it at states after the event, shape (SAMPLES,).

    At states a after the event, b = R^-1(a) before it, the rates of g(R^-1(a)) and of g(b) are compared, with those in the modes
    after and before: they are proportional but for multiples of the function, which is zero at the event.
    """
    import sympy as sp

    from nsmaps.exact.flows.formulas import PHI

    y, rng = definition.variables, np.random.default_rng(0)
    after, phases = rng.normal(size=(len(y), SAMPLES)), rng.uniform(0, TWO_PI, SAMPLES)

    def at(formulas: "Sequence[sp.Expr]", states: Floats) -> Floats:
        """Formulas at states (n, SAMPLES), shape (number of formulas, SAMPLES)."""
        given = sp.lambdify((*y, PHI, *definition.symbols), list(formulas), "numpy")
        with np.errstate(all="ignore"):
            return np.array([np.broadcast_to(value, SAMPLES) for value in given(*states, phases, *known)], float)

    def one_at(formula: "sp.Expr", states: Floats) -> Floats:
        (values,) = at([formula], states)
        return values

    def rates(mode: int) -> "Sequence[sp.Expr]":
        return definition.smooth[mode] if definition.smooth else [row.of(y) for row in definition.rates[mode]]

    reset = _affine_reset(what, definition, one)
    slopes = at(list(reset.jacobian(y)), after).mean(axis=1).reshape(len(y), len(y))
    if np.linalg.matrix_rank(slopes) < len(y):
        raise NsmapsError(
            f"{what}: the reset of the guard {one.name!r} takes different states to one, as an impact that leaves no speed; "
            "expected: a reset that can be inverted"
        )
    at_zero = reset.subs(dict.fromkeys(y, 0))
    before: Floats = np.asarray(np.linalg.solve(slopes, after - at(at_zero, after)), float)
    function, turning = one.function.of(definition.columns), one_at(definition.phase_rate, after)
    gradient, drift = at([sp.diff(function, x) for x in y], before), one_at(sp.diff(function, PHI), before)
    later = np.linalg.solve(slopes.T, gradient)
    rate = (gradient * at(rates(one.mode), before)).sum(axis=0) + turning * drift
    moved = at(rates(one.target), after) - turning * at(sp.diff(at_zero, PHI), after)
    rate_after, values = (later * moved).sum(axis=0) + turning * drift, one_at(function, before)
    usual = np.isfinite(rate) & np.isfinite(rate_after) & np.isfinite(values)
    (factor, other), *_ = np.linalg.lstsq(np.array([rate, values]).T[usual], rate_after[usual], rcond=None)
    off = np.abs(rate_after - factor * rate - other * values)[usual].max(initial=0.0)
    if factor == 0 or off > SAME * np.abs(rate_after[usual]).max(initial=0.0):
        raise NsmapsError(
            f"{what}: the function of the guard {one.name!r} may rise or fall after its event, or stay zero; expected: a rate "
            "that is a multiple of that before it"
        )
    sign = -1 if factor > 0 else 1
    return sign, sign * values
