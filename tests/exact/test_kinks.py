"""Kinks in formulas: parts of modes by the signs of their arguments, which results do not show."""

import re
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from messages import message
from pydantic import Field

from nsmaps import Guard, HybridSystem, PoincareSection, SlidingSurface
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.modes.definitions.build import definition_of
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.definitions.events.kinks import Kinks
from nsmaps.testing import check_system

X, V, P = sp.symbols("x v p", real=True)
PLACES = np.random.default_rng(3).normal(size=(20, 2)).round(3)


class Plate(HybridSystem):
    """A ball that bounces on a vibrating plate, with rates that tests replace."""

    drag: float = 0.3
    states = ("x", "v")

    def period(self) -> Any:
        return 2 * sp.pi

    def force(self, t: Any, y: SimpleNamespace) -> Any:
        return -self.drag * y.v * sp.Abs(y.v)

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"flight": {"x": y.v, "v": -1 + self.force(t, y)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"I": Guard("flight", y.x - sp.sin(t), reset={"v": -y.v / 2 + 3 * sp.cos(t) / 2})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("I", ("v", "phi"))


class Spring(Plate):
    """A spring that pushes below zero only, and one that pulls above one."""

    def force(self, t: Any, y: SimpleNamespace) -> Any:
        return sp.Max(-4 * y.x, 0) - sp.Piecewise((9 * (y.x - 1), y.x > 1), (0, True))

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"M": Guard("flight", y.v)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("M", ("x", "phi"))


@pytest.mark.parametrize(
    "formula",
    [
        sp.Abs(2 * X - V) * V,
        sp.sign(V) * V**2,
        sp.Heaviside(X) * X,
        sp.Max(X, V, X * V, P),
        sp.Min(X, 1, V),
        sp.Piecewise((X**2, X > V), (V, sp.And(V > 1, X > 0)), (X + V, True)),
        sp.Max(0, X + V * sp.Abs(X)),
        sp.Abs(P) * X,
        sp.Heaviside(P) * X + sp.Piecewise((V, sp.Ne(P, 2)), (X, True)),
        sp.Piecewise((X, (P < 1) & (X > V)), (V, True)),
    ],
    ids=str,
)
def test_signs_in_place_of_kinks_give_the_same_values(formula: sp.Expr) -> None:
    kinks = Kinks()
    smooth = kinks.smooth(formula, {X, V})
    for x, v in PLACES.tolist():
        at = {X: x, V: v, P: 0.25}
        for argument, sign in kinks.signs.items():
            at[sign] = sp.sign(argument.subs(at))
        assert float(smooth.subs(at)) == pytest.approx(float(formula.subs({X: x, V: v, P: 0.25})), abs=1e-13)
    assert not smooth.diff(X, V).has(sp.DiracDelta, sp.Derivative)


def rates_at(definition: Definition, mode: int, x: float, v: float) -> list[float]:
    """The rates in a part of a mode, at phase 0 and the default parameters."""
    values = dict(zip(definition.variables, (x, v), strict=True)) | dict.fromkeys(definition.symbols, 0.3)
    rates = definition.smooth[mode] if definition.smooth else [row.of(definition.variables) for row in definition.rates[mode]]
    return [float(rate.subs(values)) for rate in rates]


def parts_at(definition: Definition, x: float, v: float) -> list[int]:
    """The parts of modes in which no function of an event without a reset is negative."""
    values = dict(zip(definition.variables, (x, v), strict=True)) | dict.fromkeys(definition.symbols, 0.3)
    watched = [one for one in definition.transitions if not one.letter]
    below = {one.mode for one in watched if float(one.function.of(definition.columns).subs(values)) < 0}
    return [mode for mode in range(len(definition.modes)) if mode not in below]


@pytest.mark.parametrize(("system", "parts", "nonlinear"), [(Plate(), 2, True), (Spring(), 8, False)])
def test_a_part_has_the_rates_of_the_formula_where_its_signs_hold(system: Plate, parts: int, nonlinear: bool) -> None:
    definition = definition_of(system)
    assert definition.modes == ("flight",) * parts
    assert bool(definition.smooth) == nonlinear
    for x, v in PLACES.tolist():
        force = float(system.force(0, SimpleNamespace(x=sp.Float(x), v=sp.Float(v))))
        found = parts_at(definition, x, v)
        assert len(found) == (2 if isinstance(system, Spring) and v < 0 else 1)  # before and after the maximum
        for mode in found:
            assert rates_at(definition, mode, x, v) == pytest.approx([v, force - 1], abs=1e-13)


def test_a_piecewise_linear_spring_returns_as_with_a_mode_for_each_piece() -> None:
    class Pieces(Spring):
        """The same with three modes."""

        def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
            forces = {"low": -4 * y.x, "free": 0, "high": -9 * (y.x - 1)}
            return {mode: {"x": y.v, "v": force - 1 + sp.cos(t)} for mode, force in forces.items()}

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
            return {
                "M": Guard(("low", "free", "high"), y.v),
                "fall": Guard("free", y.x, to="low", letter=""),
                "rise": Guard("low", -y.x, to="free", letter=""),
                "out": Guard("free", 1 - y.x, to="high", letter=""),
                "back": Guard("high", y.x - 1, to="free", letter=""),
            }

    class Forced(Spring):
        """With the same forcing."""

        def force(self, t: Any, y: SimpleNamespace) -> Any:
            return super().force(t, y) + sp.cos(t)

    starts = np.array([[2.0, 0.4], [0.7, 1.0], [-0.1, 2.0], [1.4, 5.0]])
    one, other = (system.first_return(starts, derivative=True) for system in (Forced(), Pieces()))
    assert one.outcome.tolist() == other.outcome.tolist()
    assert one.words.tolist() == other.words.tolist()
    assert np.isfinite(one.image).all()
    assert one.image == pytest.approx(other.image, rel=1e-12)
    assert one.derivative == pytest.approx(other.derivative, rel=1e-9)


def test_drag_of_a_speed_times_its_size_is_that_of_the_closed_form() -> None:
    pytest.importorskip("heyoka")

    class Ball(Plate):
        """On a plate that stands still."""

        def force(self, t: Any, y: SimpleNamespace) -> Any:
            return super().force(t, y) * sp.sign(self.drag) * sp.Max(self.drag / 2, -1) / sp.Abs(self.drag / 2)

        def period(self) -> Any:
            return None

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
            return {"I": Guard("flight", y.x, reset={"v": -y.v})}

        def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
            return PoincareSection("I", ("v",))

    ball, u = Ball(), np.array([1e-4, 0.9, 3.0])
    returns = ball.first_return(-u[:, None], derivative=True)
    assert returns.words.tolist() == ["II"] * 3
    assert returns.image[:, 0] == pytest.approx(-u / np.sqrt(1 + ball.drag * u**2), rel=4e-15)
    assert returns.derivative[:, 0, 0] == pytest.approx((1 + ball.drag * u**2) ** -1.5, rel=4e-15)


class Dish(HybridSystem):
    """A ball that bounces in a parabolic dish, with a drag k u |u| along the ground."""

    k: float = Field(0.1, description="drag")
    states = ("x", "y", "u", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"flight": {"x": y.u, "y": y.v, "u": -self.k * y.u * sp.Abs(y.u), "v": -1}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        across = (y.v - y.x * y.u) / (1 + y.x**2)
        return {"W": Guard("flight", y.y - y.x**2 / 2, reset={"u": y.u + 2 * across * y.x, "v": y.v - 2 * across})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("W", ("x", "u", "v"))


def test_a_curved_wall_with_a_curved_reset_is_that_of_an_integrator() -> None:
    pytest.importorskip("heyoka")
    rng = np.random.default_rng(0)
    check_system(Dish(), states=rng.uniform((-1, -0.5, -1.5), (1, 0.5, -0.5), (20, 3)))


class Shot(HybridSystem):
    """A body that the air slows down over a way of one, with a coefficient in pieces of a parameter: v' = -c v^2."""

    p: float
    states = ("x", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        inside = sp.Or(sp.Not(self.p < 1), sp.Eq(self.p, -2))
        drag = sp.Heaviside(self.p) * self.p + sp.Piecewise((3, inside), (self.p**2, (self.p < 1) & (self.p > -1)), (1, True))
        return {"air": {"x": y.v, "v": -drag * y.v**2}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"T": Guard("air", 1 - y.x, reset={"x": y.x - 1})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("T", ("v",))


@pytest.mark.parametrize(("p", "drag", "slope"), [(0.5, 0.75, 2.0), (-0.5, 0.25, -1.0), (1.5, 4.5, 1.0), (-2.0, 3.0, 0.0)])
def test_nonlinear_rates_may_be_in_pieces_of_parameters(p: float, drag: float, slope: float) -> None:
    """The speed falls as exp(-c x)."""
    system, start = Shot(p=p), np.array([[0.8], [2.0]])
    returns, expected = system.first_return(start, derivative=True), start * np.exp(-drag)
    assert len(system._definition().modes) == 1
    np.testing.assert_allclose(returns.image, expected, rtol=1e-14)
    np.testing.assert_allclose(returns.derivative.ravel(), np.exp(-drag), rtol=1e-13)
    np.testing.assert_allclose(system.sensitivity(start, {"p": 1.0}), -slope * expected, rtol=1e-13, atol=1e-15)


def test_an_invariant_guard_leaves_one_part_and_a_guard_with_a_kink_has_a_function_in_each() -> None:
    class Box(Plate):
        """A wall on each side, in one formula."""

        def force(self, t: Any, y: SimpleNamespace) -> Any:
            return sp.Abs(y.x - sp.sin(t))

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
            return {**super().guards(t, y), "W": Guard("flight", 2 - sp.Abs(y.v), reset={"v": y.v / sp.Abs(y.v)})}

    definition = definition_of(Box())
    assert definition.modes == ("flight",) * 2
    x, v = definition.variables
    walls = {one.function.of(definition.columns) for one in definition.transitions if one.name == "W"}
    assert walls == {2 - v, 2 + v}
    assert all(rates[1].of(definition.columns) == x - sp.sin(sp.Symbol("_phi", real=True)) - 1 for rates in definition.rates)


def test_contact_that_lasts_and_sliding_follow_from_rates_with_kinks() -> None:
    class Resting(Plate):
        """A ball that may rest on a floor that stands still, with drag."""

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
            return {"I": Guard("flight", y.x, reset={"v": -y.v / 2}, rests="floor")}

    definition = definition_of(Resting())
    assert set(definition.modes) == {"flight", "floor"}
    x, v = definition.variables
    (drag,) = definition.symbols
    pressures = {one.begins[1].of(definition.columns) for one in definition.transitions if one.begins}
    assert pressures == {drag * v**2 + 1, 1 - drag * v**2}

    class Rubbing(Plate):
        """A body on a belt of speed 2, with friction on the belt and drag in the air."""

        def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
            free = -y.x + self.force(t, y)
            return {"fast": {"x": y.v, "v": free - 1}, "slow": {"x": y.v, "v": free + 1}}

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
            return {"stick": SlidingSurface("fast", "slow", y.v - 2), "turn": Guard("slow", y.v)}

        def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
            return PoincareSection("turn", ("x", "phi"))

    definition = definition_of(Rubbing())
    (surface,) = definition.surfaces
    assert sp.expand(surface.rows[1].of(definition.columns)) == -x - 4 * drag - 1  # on the belt the speed is positive


@pytest.mark.parametrize(
    ("force", "said"),
    [
        (lambda y: -sp.sign(y.v), message("exact.own-jump", function="y.v")),
        (
            lambda y: sp.Max(0, -y.x) ** sp.Rational(3, 2),
            message("exact.no-series-at", formula="(-y.x)**(3/2)", function="y.x"),
        ),
        (lambda y: sp.Piecewise((y.x, y.x > 0)), message("exact.no-last-piece", state="v")),
        (
            lambda y: sp.Piecewise((y.x, sp.Ne(y.x, 0)), (1, True)),
            message("exact.piecewise-condition", condition=re.compile("Ne.*")),
        ),
    ],
)
def test_kinks_that_cannot_be_followed_are_refused_with_a_way_out(force: Any, said: str) -> None:
    class Other(Plate):
        """Another force."""

        def force(self, t: Any, y: SimpleNamespace) -> Any:
            return force(y)

    with pytest.raises(SystemDefinitionError, match=said):
        definition_of(Other())
