"""Contact that lasts: chatter, rest and release as impact systems have them, and with other masses in motion."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from chattering import Held
from hybrid import BeforeWall
from messages import message
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_impact_oscillator import ImpactOscillator
from nsmaps_recoil_pair import RecoilPair
from nsmaps_vi_pair import VIPair
from scipy.integrate import solve_ivp
from systems import BallInModes

import nsmaps
from nsmaps import Axis, Grid, Guard, HybridSystem, ImpactSystem, PoincareSection
from nsmaps.errors import ProofError, SystemDefinitionError
from nsmaps.exact.outcome import Outcome


class Oscillator(BeforeWall):
    """The impact oscillator."""

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {"B": Guard("free", self.wall - y.x, reset={"v": -self.r * y.v}, rests="pressed")}


def starts(n: int, fastest: float) -> Any:
    """Random starts, some of speed zero and some of speeds of all sizes."""
    rng = np.random.default_rng(n)
    slow = rng.uniform(size=n) < 0.4
    v = np.where(slow, 10 ** rng.uniform(-14, -1, n), rng.uniform(0, fastest, n))
    v[: n // 10] = 0
    return np.column_stack([v, rng.uniform(0, 6.28, n)])


@pytest.mark.parametrize(
    ("impacts", "modes", "sign"),
    [
        (BouncingBall(Gamma=1.8, r=0.5), BallInModes(Gamma=1.8, r=0.5), -1),
        (BouncingBall(Gamma=1.2, r=0.9), BallInModes(Gamma=1.2, r=0.9), -1),
        (BouncingBall(Gamma=2.5, r=0.0), BallInModes(Gamma=2.5, r=0), -1),
        (
            ImpactOscillator(zeta=0.05, w=0.4, A=2, wall=-0.5, r=0.6),
            Oscillator(zeta=0.05, w=0.4, A=2, wall=-0.5, r=0.6),
            1,
        ),
        (ImpactOscillator(zeta=0.1, w=0.3, A=3, wall=0.2, r=0.8), Oscillator(zeta=0.1, w=0.3, A=3, wall=0.2, r=0.8), 1),
    ],
    ids=str,
)
def test_words_images_and_derivatives_are_those_of_impact_systems(impacts: ImpactSystem, modes: HybridSystem, sign: int) -> None:
    given = starts(400, 4.0)
    expected, returns = impacts.first_return(given, derivative=True), modes.first_return(given * [sign, 1], derivative=True)
    assert (expected.outcome == Outcome.stuck).sum() > 15
    assert np.array_equal(expected.words, returns.words)
    assert np.array_equal(expected.outcome, returns.outcome)
    assert expected.derivative is not None
    assert returns.derivative is not None
    size = np.maximum(1, np.abs(expected.derivative).max(axis=(1, 2), initial=1))
    off = expected.lifted * [sign, 1] - returns.lifted
    assert np.nanmax(np.abs(off) / size[:, None]) < 2e-13
    stuck = expected.outcome == Outcome.stuck
    assert np.abs(returns.derivative[stuck]).max() < 1e-12


def test_orbits_through_chatter_and_release() -> None:
    """Returns from the release on, whose speed is zero and whose acceleration is zero but for rounding."""
    impacts, modes = BouncingBall(Gamma=1.8, r=0.3), BallInModes(Gamma=1.8, r=0.3)
    expected, returns = impacts.orbits([[0.01, 1.0]], 300), modes.orbits([[-0.01, 1.0]], 300)
    assert (expected.outcome == Outcome.stuck).sum() > 5
    assert np.array_equal(expected.words, returns.words)
    assert np.abs(expected.image * [-1, 1] - returns.image).max() < 1e-9


class Sprung(HybridSystem):
    """The gap of a ball on a spring above a table that moves with two harmonics."""

    states = ("x", "v")

    def period(self) -> Any:
        return 2 * sp.pi

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Any]:
        table = sp.cos(t) + sp.cos(2 * t) / 5
        return {"fly": {"x": y.v, "v": -0.9 - 0.3 * (y.x + table) - 0.05 * (y.v + sp.diff(table, t)) - sp.diff(table, t, 2)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {"B": Guard("fly", y.x, reset={"v": -0.6 * y.v}, rests="contact")}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("B", ("v", "phi"))


def test_a_release_does_not_depend_on_what_came_to_rest() -> None:
    """Not even by rounding, of which exponents would be the logarithm."""
    phases = np.linspace(3.6, 4.2, 20)
    made = Sprung().first_return(np.stack([-(10.0 ** -np.arange(12, 32)), phases], axis=1), derivative=True)
    assert set(made.outcome.tolist()) == {Outcome.stuck}
    assert not made.derivative.any()
    assert np.ptp(made.image[:, 1]) < 1e-14


def test_a_ball_that_is_never_released() -> None:
    returns = BallInModes(Gamma=0.9, r=0.5).first_return([[0.0, 1.0], [-1e-14, 2.0]])
    assert list(returns.outcome) == [Outcome.rests] * 2
    assert list(returns.words) == ["B_", "B~"]


def test_chatter_on_the_other_wall_is_one_event_of_the_word() -> None:
    values = {"d": 0.35, "g_bar": -0.9, "r": 0.3}
    given = starts(100, 1.5)[[4, 31, 34, 51, 63, 70, 74, 0, 1, 2, 3, 5]]  # the other 88 chatter without end too
    expected = VIPair(**values).first_return(given)
    assert expected.valid.tolist() == [True] * 7 + [False] * 5
    assert np.char.find(expected.words[7:], "T~T~").min() > 0
    rows = np.column_stack([given[:, 0], np.zeros((len(given), 2)), given[:, 1]])
    returns = RecoilPair(eta=0, kappa=0, Lambda=0, contact=True, **values).first_return(rows)
    for mine, theirs in zip(returns.words, expected.words, strict=True):
        assert mine == theirs or (mine.endswith("...") and mine[:20] == theirs[:20])
    assert np.abs(expected.lifted - returns.lifted[:, [0, 3]])[:7].max() < 1e-10


def test_ball_and_capsule_move_as_one_in_contact() -> None:
    """The rates of contact are those of the two masses together: (1 + eta) V' is the sum of forces over the capsule's mass."""
    pair = RecoilPair(contact=True, eta=0.3, kappa=0.4, Lambda=0.1, d=0.35, g_bar=0.2, r=0.5)
    table = pair._kernel().definition
    force = {"X": -0.4, "V": -0.1}
    rows = dict(zip(table.states, table.rates[table.modes.index("base")], strict=True))
    values = dict(zip(table.symbols, pair.parameters.values(), strict=True))
    numbers = [float(c.subs(values)) for c in rows["V"].coefficients]
    assert numbers == pytest.approx([force.get(name, 0) / 1.3 for name in table.states])
    assert float(rows["V"].remainder.subs(values).subs(sp.Symbol("_phi", real=True), 0)) == pytest.approx((1 - 0.3 * 0.2) / 1.3)
    assert all(c == 0 for c in (*rows["v"].coefficients, rows["v"].remainder))


def test_release_by_a_second_mass() -> None:
    """Against an integration of the second mass alone while the first is held."""
    system = Held(b=0.05, w=0.3, f=1.5, d=0, r=0.4, k2=2.0)
    returns = system.first_return([[0.0, 0.6, 0.1, 0.5]], derivative=True)
    assert returns.words[0] == "I_"
    assert returns.outcome[0] == Outcome.stuck

    def rates(t: float, z: Any) -> list[float]:
        return [z[1], -2.0 * z[0] - 0.1 * z[1]]

    def pressure(t: float, z: Any) -> float:
        return float(1.5 * np.cos(0.5 + 0.3 * t) + 2.0 * z[0] + 0.1 * z[1])

    pressure.direction, pressure.terminal = -1, True  # type: ignore[attr-defined]
    found = solve_ivp(rates, (0, 100), [0.6, 0.1], method="DOP853", rtol=1e-12, atol=1e-14, events=pressure)
    assert returns.time[0] == pytest.approx(found.t_events[0][0], rel=1e-10)
    assert returns.image[0, :3] == pytest.approx([0, *found.y_events[0][0]], abs=1e-10)
    steps = [system.first_return([[0.0, 0.6 + h, 0.1, 0.5]]).image[0] for h in (1e-6, -1e-6)]
    assert returns.derivative is not None
    assert returns.derivative[0, :, 1] == pytest.approx((steps[0] - steps[1]) / 2e-6, abs=1e-7)


@pytest.mark.parametrize(
    ("guard", "said"),
    [
        (lambda s, y: Guard("flight", y.x, rests="table"), message("exact.rate-unchanged")),
        (lambda s, y: Guard("flight", y.x, reset={"v": -s.r * y.v + 1}, rests="table"), message("exact.not-an-impact")),
        (lambda s, y: Guard("flight", y.x, reset={"v": -s.r * y.v, "x": 1}, rests="table"), message("exact.function-changed")),
        (lambda s, y: Guard("flight", y.x, reset={"v": -s.r * y.v}, rests="flight"), message("exact.named-as-mode")),
        (
            lambda s, y: Guard("fall", y.x, reset={"v": -s.r * y.v}, rests="table"),
            message("exact.unknown-mode", name="fall", modes="flight"),
        ),
        (lambda s, y: Guard("flight", y.x, ends=True, rests="table"), message("exact.several-modes")),
    ],
)
def test_what_is_no_impact_has_no_contact(guard: Any, said: str) -> None:
    class Wrong(BallInModes):
        """A ball with another guard."""

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
            return {"B": guard(self, y)}

    with pytest.raises(SystemDefinitionError, match=said):
        Wrong(Gamma=1.8, r=0.5).first_return([[-1.0, 0.0]])


def test_a_released_pair_goes_on() -> None:
    """Returns from releases take their time; all orbits of a plane of starts come to the one attractor."""
    pair = RecoilPair(eta=0.05, kappa=0.04, Lambda=0.2, d=0.35, r=0.5, g_bar=0.2113, contact=True)
    axes = {"v": Axis(low=0.02, high=1.2, points=10), "X": Axis.at(0.19), "V": Axis.at(-0.67)}
    grid = Grid(axes={**axes, "phi": Axis(low=0, high=6.2831, points=11)})
    returns = pair.orbits(grid.states(), 150)
    assert returns.valid.all()
    assert (returns.outcome == Outcome.stuck).any()
    assert (returns.time > 0).all()
    assert [attractor.label for attractor in nsmaps.basins(pair, grid, max_returns=600).attractors] == ["1:1/T"]


class Strobe(BallInModes):
    """The ball once a period, on the table or in flight."""

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {**super().guards(t, y), "s": Guard(("flight", "table"), -sp.sin(t))}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("s", ("x", "v"))


def test_a_flight_after_a_release_has_no_minimum_at_its_start() -> None:
    """Place, speed and acceleration are zero there, whatever their rounding."""
    rng = np.random.default_rng(0)
    starts = np.column_stack([10 ** rng.uniform(-3, 0, 600), rng.uniform(-1, 1, 600)])
    found = Strobe(Gamma=1.1, r=0.3).itineraries(starts)
    released = [str(word) for word in found.words if "~" in str(word)]
    assert len(released) > 50
    assert not any("~v" in word for word in released)
    assert not (np.abs(found.clearance) < 1e-20).any()


class Shifted(Strobe):
    """The same at another phase of the forcing."""

    s: float

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"flight": {"x": y.v, "v": -1 + self.Gamma * sp.sin(t + self.s)}}


@pytest.mark.parametrize("s", [1.0, 1.5, 2.0, 2.8, 3.5])
def test_a_release_is_on_the_right_side_of_the_clock(s: float) -> None:
    """The flight after a release is known in closed form, whatever came before it."""
    table = Shifted(Gamma=1.3, r=0.5, s=s)
    starts = np.column_stack([np.geomspace(1e-3, 0.5, 30), np.linspace(-0.3, 0.3, 30)])
    found = table.first_return(starts)
    released = (np.arcsin(1 / 1.3) - s) % (2 * np.pi)
    flown = 2 * np.pi - released
    speed = -flown + 1.3 * (np.cos(released + s) - np.cos(s))
    place = -(flown**2) / 2 + 1.3 * (np.sin(released + s) - np.sin(s) + flown * np.cos(released + s))
    assert not (found.outcome == Outcome.simultaneous).any()
    direct = found.words == "sB~s"
    assert direct.sum() >= 27
    np.testing.assert_allclose(found.image[direct], np.tile([place, speed], (direct.sum(), 1)), atol=1e-14, rtol=1e-12)


def test_boxes_of_systems_with_contact_are_refused_and_those_that_accumulate_are_not_bounded() -> None:
    with pytest.raises(ProofError, match=message("exact.contact-not-enclosed", system="BallInModes", guard="B")):
        BallInModes(Gamma=1.2, r=0.4).image_boxes([[[-0.5, -0.4], [1, 1.1]]])
    found = Endless(Gamma=0.3, r=0.4).image_boxes([[[0.1, 0.11], [0.0, 0.01]], [[8.0, 8.01], [9.0, 9.01]]])
    assert found.bounded.tolist() == [False, True]
    assert Endless(Gamma=0.3, r=0.4).first_return([[0.1, 0.0]]).outcome.tolist() == [Outcome.accumulates]


class Endless(Strobe):
    """The same without lasting contact."""

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {"B": Guard("flight", y.x, reset={"v": -self.r * y.v}), "s": Guard("flight", -sp.sin(t))}


class Spun(HybridSystem):
    """A ball on a plate that each impact spins, by a share of its speed that is a rational function of parameters; spin fades."""

    a: float = 0.7
    b: float = 0.4
    c: float = 1.6
    share: str = "(a + b)/c"
    states = ("x", "v", "w")

    def modes(self, t, y):
        return {"fly": {"x": y.v, "v": -1, "w": -y.w}}

    def guards(self, t, y):
        share = sp.sympify(self.share, locals={"a": self.a, "b": self.b, "c": self.c})
        return {"B": Guard("fly", y.x, reset={"v": -y.v / 2, "w": y.w - share * y.v}, rests="plate")}

    def section(self, t, y):
        return PoincareSection("B", ("v", "w"))


@pytest.mark.parametrize("share", ["(a + b)/c", "a/(c*(a + b))", "(1 - a)/(2 + a)", "a/(b + 1/(a + c))", "(a**2 - b**2)/(a - b)"])
def test_directions_that_are_rational_functions_of_parameters(share):
    """From v = -1: half the speed for a unit of time, in which the spin fades to 1/e."""
    given = float(sp.sympify(share).subs({"a": 0.7, "b": 0.4, "c": 1.6}))
    returns = Spun(share=share).first_return([[-1.0, 0.0]])
    assert returns.image.ravel() == pytest.approx([-0.5, given * np.exp(-1)], abs=1e-14)


def test_a_direction_with_floats_that_cancel():
    """Two masses of 0.1 and 0.3 meet; in floats their shares of the relative speed do not add up to one."""

    class Pair(HybridSystem):
        states = ("gap", "one", "other")

        def modes(self, t, y):
            return {"fly": {"gap": y.other - y.one, "one": 0.5, "other": -0.5}}

        def guards(self, t, y):
            both = (0.1 * y.one + 0.3 * y.other) / (0.1 + 0.3)
            lost = 0.5 * (y.one - y.other)
            reset = {"one": both - 0.3 / 0.4 * lost, "other": both + 0.1 / 0.4 * lost}
            return {"B": Guard("fly", y.gap, reset=reset, rests="together")}

        def section(self, t, y):
            return PoincareSection("B", ("one", "other"))

    returns = Pair().first_return([[1.0, -1.0]])  # apart at the speed 1, with 1 of relative acceleration: for a time of 2
    assert returns.image.ravel() == pytest.approx([-0.5 - 0.75 + 1, -0.5 + 0.25 - 1], abs=1e-14)


def test_a_direction_that_changes_is_refused():
    turning = type("Turning", (Spun,), {"reset_spin": lambda self, y: y.w - y.w * y.v})
    turning.guards = lambda self, t, y: {"B": Guard("fly", y.x, reset={"v": -y.v / 2, "w": self.reset_spin(y)}, rests="plate")}
    with pytest.raises(SystemDefinitionError, match=message("exact.share-of-state", state="w", share="2*y.w/3")):
        turning().first_return([[-1.0, 0.0]])
