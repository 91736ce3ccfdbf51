"""Definitions of nonlinear systems: affine rows over own and derived states, rates as formulas, sections, contact, sliding."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from messages import message

from nsmaps import Guard, HybridSystem, PoincareSection, SlidingSurface
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.modes.definitions.build import definition_of
from nsmaps.exact.modes.definitions.definition import Definition

AT = sp.Rational(3, 7), sp.Rational(5, 4), sp.Rational(-2, 3), sp.Rational(1, 9)  #: values of states


class Pendulum(HybridSystem):
    """A forced pendulum with a stop, at which it may rest."""

    c: float = 0.5
    f: float = 0.6
    w: float = 0.7
    stop: float = 0.3
    states = ("a", "b")

    def period(self) -> Any:
        return 2 * sp.pi / self.w

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"m": {"a": y.b, "b": -sp.sin(y.a) - self.c * y.b + self.f * sp.cos(self.w * t)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"I": Guard("m", self.stop - y.a, reset={"b": -y.b / 2}, rests="stick")}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("I", ("b", "phi"))


class Hopper(HybridSystem):
    """A mass on a massless spring, whose touchdown and apex have coordinates that pass zero."""

    k: float = 10.0
    states = ("x", "y", "u", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        pull = self.k * (1 / sp.sqrt(y.x**2 + y.y**2) - 1)
        fall = {"x": y.u, "y": y.v, "u": 0, "v": -1}
        return {"flight": fall, "stance": fall | {"u": pull * y.x, "v": pull * y.y - 1}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        length = sp.sqrt(y.x**2 + y.y**2)
        return {
            "A": Guard("flight", y.v),
            "T": Guard("flight", y.y - sp.Rational(9, 10), to="stance", reset={"x": -sp.sqrt(sp.Rational(19, 100))}),
            "L": Guard("stance", 3 - 3 * length, to="flight"),
            "C": Guard("stance", length - 1 / sp.S(2), ends=True),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("A", ("y", "u"), states={"x": 0})


class Moving(HybridSystem):
    """A cubic spring with damping that changes with the phase, and a wall whose place depends on speed and phase."""

    d: float = 0.2
    states = ("x", "v")

    def period(self) -> Any:
        return 2 * sp.pi

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"m": {"x": y.v, "v": -y.x - y.x**3 - self.d * y.v * (1 + sp.cos(t))}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        wall = 1 - y.x - self.d * y.v**2 * sp.sin(t) + sp.cos(t)
        return {"I": Guard("m", wall, reset={"v": -y.v / 2}, where=[y.v**2 - y.x**2])}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("I", ("v", "phi"))


class Belt(HybridSystem):
    """A cubic oscillator on a belt of speed 1, whose friction falls with the relative speed."""

    mu: float = 0.4
    states = ("x", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        force, friction = -y.x - y.x**3, self.mu / (1 + (y.v - 1) ** 2)
        return {"fast": {"x": y.v, "v": force - friction}, "slow": {"x": y.v, "v": force + friction * sp.exp(y.x)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"stick": SlidingSurface("fast", "slow", y.v - 1), "turn": Guard("slow", y.v)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("turn", ("x",))


def read(system: HybridSystem) -> tuple[Definition, dict[sp.Symbol, sp.Expr]]:
    """A definition, and rational values of all symbols."""
    definition = definition_of(system)
    values = dict(zip(definition.variables, AT, strict=False)) | {PHI: sp.Rational(2, 5)}
    return definition, values | {p: sp.Rational(1 + k, 3) for k, p in enumerate(definition.symbols)}


def stated(system: HybridSystem) -> tuple[Any, Any]:
    """The modes and guards of a system at the same values."""
    definition, values = read(system)
    at = system.model_construct(**{str(p)[3:]: values[p] for p in definition.symbols})
    y = SimpleNamespace(**{name: values[x] for name, x in zip(definition.states, definition.variables, strict=True)})
    period = at.period()
    t = 0 if period is None else values[PHI] * period / (2 * sp.pi)
    return at.modes(t, y), at.guards(t, y)


@pytest.mark.parametrize("system", [Pendulum(), Hopper(), Moving(), Belt()], ids=lambda one: type(one).__name__)
def test_rows_and_rates_are_the_formulas_of_the_class(system: HybridSystem) -> None:
    definition, values = read(system)
    modes, guards = stated(system)
    n, compared = len(definition.states), 0
    total = n + len(definition.derived)
    for mode, smooth, rows in zip(definition.modes, definition.smooth, definition.rates, strict=True):
        assert len(rows) == total
        assert not any(any(row.coefficients) or row.remainder for row in rows)
        for rate, name in zip(smooth, definition.states, strict=True) if mode in modes else ():
            assert sp.N(rate.subs(values) - modes[mode][name], 30) == pytest.approx(0, abs=1e-28)
            compared += 1
    for one in definition.transitions:
        assert len(one.reset) == total
        assert all(len(row.coefficients) == total for row in (one.function, *one.reset, *one.where, *one.begins, *one.held))
        assert not any(row.variables for row in (one.function, *one.where))
        if one.name in guards and one.mode == definition.modes.index(guards[one.name].watched[0]) and not one.releases:
            function = one.function.of(definition.columns).subs(values)
            assert sp.N(function - guards[one.name].function, 30) == pytest.approx(0, abs=1e-28)
            compared += 1
    assert compared >= n + 1


def test_equal_expressions_are_one_derived_state_whatever_their_factor_and_what_is_added() -> None:
    x, y = read(Hopper())[0].variables[:2]
    assert read(Hopper())[0].derived == (sp.sqrt(x**2 + y**2),)


def test_affine_systems_have_neither_derived_states_nor_formulas_of_rates() -> None:
    class Straight(Pendulum):
        """The same without gravity."""

        def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
            return {"m": {"a": y.b, "b": (y.a + 1) ** 2 - y.a**2 + self.f * sp.cos(self.w * t) ** 2}}

    definition = definition_of(Straight())
    assert (definition.derived, definition.smooth) == ((), ())
    assert definition.rates[0][1].coefficients == (2, 0)


def test_the_state_that_a_curved_guard_gives_is_a_formula_of_the_coordinates() -> None:
    definition, values = read(Moving())
    (start,) = definition.starts
    ((place, formula),) = start.curved
    x, v = definition.variables
    assert (place, formula.free_symbols) == (0, {v, PHI, *definition.symbols})
    on = values | {x: formula.subs(values)}
    (surface,) = start.surface
    assert sp.N(surface.of(definition.columns).subs(on), 30) == pytest.approx(0, abs=1e-28)


def test_a_state_in_which_the_guard_rises_is_solved_for() -> None:
    class Rising(Moving):
        """A wall at which the exponential of x is what the speed and the phase say."""

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
            return {"I": Guard("m", 2 + y.v**2 + sp.cos(t) - sp.exp(y.x), reset={"v": -y.v})}

    definition = definition_of(Rising())
    (start,) = definition.starts
    assert start.curved == ((0, sp.log(definition.variables[1] ** 2 + sp.cos(PHI) + 2)),)


def test_reciprocals_of_known_functions_are_written_out() -> None:
    class Steep(Moving):
        """A force that is a secant."""

        def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
            return {"m": {"x": y.v, "v": sp.sec(y.x) - sp.coth(y.v)}}

    definition = definition_of(Steep())
    x, v = definition.variables
    assert definition.smooth[0][1] == 1 / sp.cos(x) - sp.cosh(v) / sp.sinh(v)


def test_contact_presses_with_the_free_acceleration_at_the_stop() -> None:
    definition = definition_of(Pendulum())
    (release,) = [one for one in definition.transitions if one.releases]
    c, f, _, stop = definition.symbols
    assert release.function.of(definition.columns) == f * sp.cos(PHI) - sp.sin(stop)
    (begins,) = [one for one in definition.transitions if one.begins]
    a, b = definition.variables
    assert begins.begins[1].of(definition.columns) == f * sp.cos(PHI) - sp.sin(a) - c * b
    assert definition.smooth[definition.modes.index("stick")] == (b, 0)


class Crane(HybridSystem):
    """A heavy cart that is pushed to a wall at x = 0, from which it returns, and a light pendulum on it."""

    push: float = 0.7
    states = ("x", "v", "a", "b")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"free": {"x": y.v, "v": -self.push, "a": y.b, "b": self.push * sp.cos(y.a) - sp.sin(y.a)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        hit = 3 * y.v / 2
        return {
            "I": Guard("free", y.x, reset={"v": y.v - hit, "b": y.b + hit * sp.cos(y.a)}, rests="still"),
            "S": Guard(("free", "still"), y.a),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("S", ("x", "v", "b"))


def test_a_body_at_rest_on_a_wall_takes_what_hangs_on_it_along_its_own_direction() -> None:
    definition = definition_of(Crane())
    _, v, a, b = definition.variables
    still = dict(zip(definition.modes, definition.smooth, strict=True))["still"]
    assert [sp.expand(rate) for rate in still] == [v, 0, b, -sp.sin(a)]
    rests = [dict(one.curved) for one in definition.transitions if one.begins]
    assert rests == [{3: b + v * sp.cos(a)}] * len(rests) != []


def test_sliding_holds_the_surface_at_filippovs_rates() -> None:
    definition, values = read(Belt())
    stick = dict(zip(definition.modes, definition.smooth, strict=True))["stick"]
    _, v = definition.variables
    assert [sp.N(rate.subs(values | {v: 1}), 30) for rate in stick] == pytest.approx([1, 0], abs=1e-28)


class Ring(HybridSystem):
    """Two fields that lead to the unit circle, radially at the rate of the distance and around it at 3/2 and 1/2."""

    states = ("x", "y")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        turn, pull = {"x": -y.y, "y": y.x}, {"x": -y.x, "y": -y.y}
        return {
            "out": {name: 3 * turn[name] / 2 + pull[name] for name in turn},
            "in": {name: turn[name] / 2 - pull[name] for name in turn},
        }

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"ring": SlidingSurface("out", "in", y.x**2 + y.y**2 - 1), "S": Guard(("out", "in", "ring"), y.y)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("S", ("x",))


def test_motions_slide_along_a_curved_surface() -> None:
    pytest.importorskip("heyoka")
    returns = Ring().first_return([[-2.0], [-0.01]])
    assert returns.words.tolist() == ["SrS"] * 2
    assert returns.image[:, 0] == pytest.approx(-1, rel=1e-14)
    assert returns.time == pytest.approx([2 * np.pi - np.log(2) / 2, 2 * np.pi + np.log(100) / 2], rel=1e-14)


class Curved(Hopper):
    """A section at the curved surface."""

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("L", ("y", "u", "v"))


class Known(Curved):
    """The same with the formula that the surface does not give."""

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("L", ("y", "u", "v"), states={"x": sp.sqrt(1 - y.y**2)})


class Wrong(Curved):
    """The same with another formula."""

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("L", ("y", "u", "v"), states={"x": y.y**2})


class Resting(Hopper):
    """Contact at the curved surface."""

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"A": Guard("flight", y.x**2 + y.y, reset={"v": -y.v}, rests="stick")}


class Clocked(Moving):
    """A section at a clock whose function has infinitely many harmonics, beside such a force."""

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"m": {"x": y.v, "v": sp.exp(sp.cos(t)) - y.x}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"S": Guard("m", -sp.sin(t) * sp.exp(sp.sin(t)))}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("S", ("x", "v"))


class Stepping(Hopper):
    """A force in steps."""

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"flight": {"x": y.u, "y": y.v, "u": sp.floor(y.x), "v": -1}}


def test_a_section_on_a_curved_surface_takes_the_formula_that_is_given() -> None:
    definition = definition_of(Known())
    assert all(start.curved == ((0, sp.sqrt(1 - definition.variables[1] ** 2)),) for start in definition.starts)
    assert len(definition.starts) > 0


@pytest.mark.parametrize(
    ("system", "said"),
    [
        (Curved(), message("exact.section-open-not-linear", names="x", guard="L", example="{'x': ...}")),
        (Wrong(), message("exact.section-not-affine")),
        (Clocked(), message("exact.no-harmonics", guard="S", formula="-exp(sin(phi))*sin(phi)")),
        (Resting(), message("exact.not-affine-contact", mode="stick", formula="y.x**2 + y.y")),
        (Stepping(), message("exact.no-series", what="in mode 'flight' the rate of u", formula="floor(y.x)", function="floor")),
    ],
)
def test_what_cannot_be_followed_is_refused_with_a_way_out(system: HybridSystem, said: str) -> None:
    with pytest.raises(SystemDefinitionError, match=said):
        definition_of(system)


class Clocked(HybridSystem):
    """A body rests on a floor, x = 0, while z runs to w + x = z^2, where it is halved; the section gives w by x and z."""

    states = ("x", "v", "z", "w")

    def modes(self, t, y):
        return {"fly": {"x": y.v, "v": -1, "z": 1, "w": 0}}

    def guards(self, t, y):
        clock = Guard("floor", y.w + y.x - y.z**2, reset={"z": y.z / 2})
        return {"B": Guard("fly", y.x, reset={"v": -y.v / 2}, rests="floor"), "E": clock}

    def section(self, t, y):
        return PoincareSection("E", ("x", "z"))


def test_states_beside_a_section_are_moved_onto_it_where_a_nonlinear_function_gives_another_state() -> None:
    system = Clocked()
    placed = system.on_section([[0.3, 2.0], [-1e-3, 0.5], [0.0, 1.0]])
    assert placed.tolist() == [[0.0, 2.0], [0.0, 0.5], [0.0, 1.0]]
    assert system.first_return(placed).image == pytest.approx(placed, abs=1e-14)
