"""What cannot be a system with modes is refused by a sentence, and what a motion cannot decide is an outcome; random systems."""

import re
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message

from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.outcome import Outcome


class Corner(HybridSystem):
    """A point in a corner of two rough walls: the order of impacts matters."""

    pull: float = 1.0

    states = ("x", "y", "u", "v")
    horizon = 50.0

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"flight": {"x": y.u, "y": y.v, "u": -0.1 * self.pull, "v": -0.1}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        first, second = {"u": -0.8 * y.u, "v": y.v + 0.3 * y.u}, {"u": y.u + 0.2 * y.v, "v": -0.7 * y.v}
        return {"X": Guard("flight", y.x, reset=first), "Y": Guard("flight", y.y, reset=second), **self.others(y)}

    def others(self, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {"S": Guard("flight", y.x + y.y - 2)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("S", ("x", "u", "v"))


def test_two_walls_at_once_are_an_outcome() -> None:
    """Towards the corner along the diagonal both walls are met at the same time; beside it one is first."""
    returns = Corner().first_return([[1.0, -1.0, -1.0], [1.0, -1.01, -1.0], [1.0, -1.0, -1.01]])
    assert list(returns.outcome) == [Outcome.simultaneous, Outcome.returned, Outcome.returned]
    assert [str(word)[:3] for word in returns.words[1:]] == ["SXY", "SYX"]


def test_a_section_that_is_never_met_is_an_outcome() -> None:
    class Away(Corner):
        """A point without the force that turns it back."""

        def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
            return {"flight": {"x": y.u, "y": y.v, "u": 0, "v": 0}}

    returns = Away().first_return([[1.0, 1.0, -2.5]])
    assert returns.outcome[0] == Outcome.escaped
    assert np.isnan(returns.image).all()


def test_a_mode_without_an_exit_is_refused() -> None:
    class Shut(Corner):
        """One wall leads to a mode without guards."""

        def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
            return {**super().modes(t, y), "shut": {"x": 0, "y": 0, "u": 0, "v": 0}}

        def others(self, y: SimpleNamespace) -> Mapping[str, Guard]:
            return {**super().others(y), "Z": Guard("flight", 9 - y.x, to="shut")}

    with pytest.raises(SystemDefinitionError, match=message("exact.nothing-watched", mode="shut")):
        Shut().first_return([[1.0, -1.0, -1.0]])


def test_a_division_by_zero_is_refused() -> None:
    class Heavy(Corner):
        """A rate over a parameter."""

        def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
            return {"flight": {"x": y.u / self.pull, "y": y.v, "u": -1, "v": -1}}

    with pytest.raises(SystemDefinitionError, match=message("exact.divides-by-zero", parameters=0)):
        Heavy(pull=0.0).first_return([[1.0, -1.0, -1.0]])


def test_a_formula_that_cannot_be_followed_is_refused_with_its_place() -> None:
    """A function of a guard without a series, such a condition, a reset after one turn, and contact at a curved wall."""

    class Bent(Corner):
        """A wall that is a parabola."""

        kind: int = 0

        def period(self) -> Any:
            return 2 * sp.pi

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
            one = (
                Guard("flight", y.y - sp.floor(y.x)),
                Guard("flight", y.y, where=(sp.besselj(0, y.u),)),
                Guard("flight", y.y, reset={"v": -y.v * y.u * t}),
                Guard("flight", y.y - y.x**2, reset={"v": -y.v}, rests="floor"),
            )
            return {"I": one[self.kind]}

        def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
            return PoincareSection("I", ("x", "u", "v"))

    ends = message("exact.place", place=f"{__file__}:{Bent.guards.__code__.co_firstlineno}")
    whys = (
        message("exact.no-series", what="the function of Bent.guards: 'I'", formula="y.y - floor(y.x)", function="floor"),
        message("exact.no-series", what="a condition of Bent.guards: 'I'", formula="besselj(0, y.u)", function="besselj"),
        message("exact.reset-not-periodic", state="v", cls="Bent", guard="I"),
        message("exact.not-affine-contact", guard="I", mode="floor", formula="-y.x**2 + y.y", at="Bent.guards"),
    )
    for kind, why in enumerate(whys):
        with pytest.raises(SystemDefinitionError, match=f"^{why}.*{ends}"):
            Bent(kind=kind).first_return([[1.0, -1.0, -1.0]])


NUMBERS = st.floats(-2, 2).map(lambda x: round(x, 2))


@settings(max_examples=8, deadline=None)
@given(st.data())
def test_random_systems_end_and_stay_on_the_right_side_of_guards(data: Any) -> None:
    """Linear modes of 1 to 4 states with two walls x = 1 and x = -1, at which modes change and states jump."""
    n, m = data.draw(st.integers(1, 4)), data.draw(st.integers(1, 3))
    rates = np.array(data.draw(st.lists(NUMBERS, min_size=m * n * (n + 2), max_size=m * n * (n + 2)))).reshape(m, n, n + 2)
    jumps = np.array(data.draw(st.lists(NUMBERS, min_size=2 * n, max_size=2 * n))).reshape(2, n) / 4
    names = tuple(f"x{k}" for k in range(n))

    class Random(HybridSystem):
        """A system of these numbers."""

        states = names
        horizon = 20.0

        def period(self) -> Any:
            return 2 * sp.pi

        def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
            features = [*(getattr(y, name) for name in names), 1, sp.cos(t)]

            def rate(row: Any) -> Any:
                return sum(sp.Float(a) * f for a, f in zip(row, features, strict=True))

            return {f"m{k}": dict(zip(names, map(rate, rows), strict=True)) for k, rows in enumerate(rates)}

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
            found = {}
            for k in range(m):
                after = [{name: sp.Float(jump) for name, jump in zip(names, row, strict=True)} for row in jumps]
                found[f"U{k}"] = Guard(f"m{k}", 1 - y.x0, to=f"m{(k + 1) % m}", reset=after[0])
                found[f"L{k}"] = Guard(f"m{k}", 1 + y.x0, to=f"m{(k + 2) % m}", reset=after[1])
            return found

        def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
            return PoincareSection("U0", (*names, "phi"))

    rng = np.random.default_rng(0)
    starts = np.column_stack([np.ones(6), rng.uniform(-1, 1, (6, n - 1)), rng.uniform(0, 6.28, 6)])
    returns = Random().first_return(starts)
    assert set(returns.outcome) <= {
        Outcome.returned,
        Outcome.escaped,
        Outcome.undecided,
        Outcome.invalid,
        Outcome.simultaneous,
        Outcome.endless,
    }
    assert np.abs(returns.image[returns.valid][:, 0] - 1).max(initial=0) < 1e-12
    assert (returns.time[returns.valid] >= 0).all()


class Plain(HybridSystem):
    """A ball on a plate, whose rates and guards tests replace."""

    kind: int = 0
    states = ("x", "v")

    def period(self) -> Any:
        return 2 * sp.pi

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        rates = {
            "steps": sp.floor(y.v),
            "late": -sp.Function("x")(t - 1),
            "called": -y.x(t - 1) if WRONG[self.kind][0] == "called" else 0,
            "two": sp.cos(sp.sqrt(3) * t),
        }
        return {"m": {"x": y.v, "v": rates[WRONG[self.kind][0]]}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {"B": Guard("m", y.x, reset={"v": -y.v / 2})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("B", ("v", "phi"))


WRONG = [
    ("steps", message("exact.no-series", what="in mode 'm' the rate of v", formula="floor(y.v)", function="floor")),
    ("late", message("exact.delayed-state", state="v")),
    ("called", message("exact.delay", error=re.compile(".* not callable"))),
    ("two", message("exact.second-forcing")),
]


@pytest.mark.parametrize("kind", range(len(WRONG)))
def test_what_can_be_written_instead_is_named(kind: int) -> None:
    with pytest.raises(SystemDefinitionError, match=WRONG[kind][1]):
        Plain(kind=kind).first_return([[-1.0, 1.0]])
