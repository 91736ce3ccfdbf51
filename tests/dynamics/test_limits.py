"""What orbits end on, against maps whose motions are known in closed form, and the names of motions of systems with modes."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy as sp

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.coordinates import Angle
from nsmaps.dynamics.attractors.limit_set import limit_set
from nsmaps.dynamics.limits.decision import limits
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns


@dataclass(frozen=True)
class Formula(ReturnMap):
    """A map by its formula, with its derivative or without, and without words."""

    image: Any
    slope: Any = None
    coordinates: tuple[str, ...] = ("x",)

    def first_return(self, states: Any, derivative: bool = False) -> Returns:
        x = np.asarray(states, float)
        n, slopes = len(x), self.slope(x) if derivative and self.slope else None
        with np.errstate(over="ignore", invalid="ignore"):
            image = self.image(x)
        blank = np.zeros(n, np.int64)
        return Returns(self.coordinates, (), x, image, np.zeros(x.shape, np.int32), blank, blank, np.full(n, np.nan), slopes)


def logistic(a: float, smooth: bool = True) -> Formula:
    return Formula(lambda x: a * x * (1 - x), (lambda x: (a * (1 - 2 * x))[:, :, None]) if smooth else None)


def rotation(turn: float) -> Formula:
    return Formula(lambda x: np.mod(x + 2 * np.pi * turn, 2 * np.pi), lambda x: np.ones((len(x), 1, 1)), (Angle("phi"),))


def delayed(mu: float) -> Formula:
    """x' = mu x (1 - y), y' = x: the fixed point 1 - 1/mu loses stability at mu = 2 to an invariant circle."""

    def slope(s: Any) -> Any:
        slopes = np.zeros((len(s), 2, 2))
        slopes[:, 0, 0], slopes[:, 0, 1], slopes[:, 1, 0] = mu * (1 - s[:, 1]), -mu * s[:, 0], 1
        return slopes

    return Formula(lambda s: np.column_stack([mu * s[:, 0] * (1 - s[:, 1]), s[:, 0]]), slope, ("x", "y"))


GOLDEN = (5**0.5 - 1) / 2


@pytest.mark.parametrize(
    ("map_of", "value", "label"),
    [
        (logistic, 2.99, "period 1"),  # multiplier -0.99: the orbit is still coming after 2060 returns
        (logistic, 3.001, "period 2"),
        (logistic, 3.5644, "period 8"),  # it doubles at 3.5644073
        (logistic, 3.7389, "period 5"),
        (logistic, 4.0, "C"),
        (logistic, 4.2, "escapes"),
        (rotation, 3 / 41, "period 41"),  # above half of the 60 returns that are kept
        (rotation, 100 / 401, "period 401"),
        (rotation, GOLDEN, "Q"),
        (delayed, 1.99, "period 1"),
        (
            delayed,
            2.0,
            "unresolved",
        ),  # the multipliers are the sixth roots of one: no six states near the fixed point are a cycle
        (delayed, 2.05, "Q"),
        (delayed, 2.4, "escapes"),
    ],
)
def test_motions_of_maps_by_formula(map_of: Any, value: float, label: str) -> None:
    made = nsmaps.bifurcation_diagram(map_of, "p", [value], [0.3] * len(map_of(value).coordinates))
    assert made.labels.item() == label
    assert made.period.item() == (int(label.split()[1]) if "period" in label else 0)
    assert made.held.item() == (label != "escapes")
    assert label != "escapes" or made.outcome.item() == Outcome.escaped


def test_without_derivatives_chaos_is_found_by_differences_and_slow_convergence_is_not_called_a_cycle() -> None:
    made = nsmaps.bifurcation_diagram(lambda a: logistic(a, smooth=False), "a", [3.0, 3.2, 4.0], [0.3])
    assert made.labels[:, 0].tolist() == ["unresolved", "period 2", "C"]


def test_the_exponent_of_chaos_is_that_of_the_tent_in_other_coordinates() -> None:
    found = limit_set(logistic(4.0), nsmaps.orbit(logistic(4.0), [0.3], 100))
    assert found is not None
    assert abs(found.exponent - np.log(2)) < 4 * found.exponent_error < 0.2
    assert found.text.startswith("chaos (C), followed for 1024 more returns, largest Lyapunov exponent 0.6")


def test_orbits_that_escape_are_no_attractor() -> None:
    """x -> 2 x beside the cycle of two of x -> -x: it takes 1,020 returns until numbers overflow."""
    doubling = Formula(lambda x: np.where(np.abs(x) > 1, 2 * x, -x), lambda x: np.where(np.abs(x) > 1, 2.0, -1.0)[:, :, None])
    found = nsmaps.basins(doubling, np.array([[0.5], [1.5], [-3.0]]), max_returns=200)
    assert [(one.label, one.period) for one in found.attractors] == [("period 2", 2)]
    assert found.label.tolist() == [0, -2, -2]
    assert found.outcome.tolist() == [Outcome.returned, Outcome.escaped, Outcome.escaped]


class Tank(HybridSystem):
    """A tank is filled at the rate q while the pump is on (until F), emptied at the rate 1 (until N); a bell rings at t = 0."""

    q: float = 2.0
    swapped: bool = False
    strobe: bool = False
    bell: bool = False
    states = ("h",)

    def period(self) -> Any:
        return 3

    def modes(self, t: Any, y: Any) -> Any:
        return {"on": {"h": self.q + sp.cos(2 * sp.pi * t / 3) / 4}, "off": {"h": -1}}

    def guards(self, t: Any, y: Any) -> Any:
        level = {"F": Guard("on", 2 - y.h, to="off"), "N": Guard("off", y.h, to="on")}
        bell = {"B": Guard(("on", "off"), -sp.sin(2 * sp.pi * t / 3))} if self.bell or self.strobe else {}
        return dict(reversed((level | bell).items())) if self.swapped else level | bell

    def section(self, t: Any, y: Any) -> PoincareSection:
        return PoincareSection("B", ("h",)) if self.strobe else PoincareSection("F", ("phi",))


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("bell", [False, True])
def test_names_do_not_depend_on_the_order_of_guards_or_on_clocks(swapped: bool, bell: bool) -> None:
    """Locked to the forcing: a filling and an emptying a period, 2/q + 2 = 3."""
    system = Tank(swapped=swapped, bell=bell)
    made = nsmaps.bifurcation_diagram(system, "q", [2.0], [0.5])
    assert (made.labels.item(), made.period.item()) == ("1:1/T", 1)
    cycle = nsmaps.periodic_orbit(system, made.states[0, 0, -1])
    assert (cycle.label, set(cycle.word) - {"B"}) == ("1:1/T", {"F", "N"})


@pytest.mark.parametrize(("w", "r"), [(1.5, 0.95), (2.6, 0.93)])
def test_chatter_on_the_way_is_no_attractor(w: float, r: float) -> None:
    """Chatter takes longer than the transient of 300 returns. What is found comes back to itself, in a time that repeats too."""
    system = nsmaps.load_system("impact_oscillator", zeta=0.05, w=w, A=1.0, wall=0.0, r=r)
    starts = np.random.default_rng(3).uniform([0.01, 0], [1.5, 2 * np.pi], (150, 2))
    found = nsmaps.basins(system, starts, max_returns=300)
    assert found.attractors
    for one in found.attractors:
        assert one.period
        run = system.orbits(one.states[:1], 3 * one.period)
        assert np.abs(run.image[-1] - one.states[0]).max() < 1e-6
        times = run.time.reshape(3, -1).sum(axis=1)
        assert times == pytest.approx(times[0], rel=1e-6)


class Trapped(ReturnMap):
    """x -> 3 x mod 1, but for states in a trap, which rest there and are released at one state."""

    coordinates = ("x",)

    def __init__(self, low: float, width: float, release: float) -> None:
        self.low, self.width, self.release = low, width, release

    def first_return(self, states: Any, derivative: bool = False) -> Returns:
        x = np.asarray(states, float)
        rests = (x > self.low) & (x < self.low + self.width)
        image = np.where(rests, self.release, np.mod(3 * x, 1))
        outcome = np.where(rests[:, 0], Outcome.stuck, Outcome.returned)
        slopes = np.where(rests, 0.0, 3.0)[:, :, None] if derivative else None
        blank = np.zeros(len(x), np.int64)
        return Returns(self.coordinates, (), x, image, np.zeros(x.shape, np.int32), blank, outcome, np.ones(len(x)), slopes)

    def exact_period(self) -> int:
        """From release to release, in rational arithmetic."""
        x, low, width = (Fraction(number) for number in (self.release, self.low, self.width))
        period = 1
        while not low < x < low + width:
            x, period = 3 * x % 1, period + 1
        return period


@pytest.mark.parametrize("release", [0.1234, 0.456, 0.777])
def test_cycles_between_rests_are_those_of_the_map_or_unresolved(release):
    """In floats all of them repeat; differences grow by 3 a return, so that those beyond about 25 returns are not the map's."""
    long = Trapped(0.6, 0.01, release)
    short = Trapped(float(3**8 * Fraction(release) % 1) - 0.001, 0.002, release)
    for return_map in (long, short):
        (found,) = limits(return_map, np.array([[release]]), np.ones(1))
        assert found.rests == (return_map.exact_period() > 25)
        assert (found.kind, found.period) == (("unresolved", 0) if found.rests else ("", return_map.exact_period()))
    assert long.exact_period() > 25 > short.exact_period()


def test_a_diagram_that_stores_a_whole_cycle_of_floats_names_it_only_if_it_is_determined():
    systems = {value: nsmaps.load_system("bouncing_ball", Gamma=value, r=0.72208) for value in (1.3, 3.13131)}
    diagram = nsmaps.bifurcation_diagram(systems.__getitem__, "p", list(systems), [1.0, 1.0], n_returns=700)
    assert diagram.labels.tolist() == [["B~B/T"], ["unresolved"]]
    assert (diagram.period > 0).tolist() == [[True], [False]]


@pytest.mark.parametrize(
    ("Gamma", "r", "turns"),
    [
        (1.82437, 0.44679, 11),
        (2.64206, 0.35934, 7),
        (1.77, 0.5, 17),
        (1.83, 0.5, 29),
        (1.81, 0.5, 80),  # 39 in floats
        (1.85, 0.5, 221),  # 74 in floats
    ],
)
def test_a_ball_that_rests_is_on_a_cycle_from_release_to_release(Gamma, r, turns):
    """The turns are those of 160 and of 260 digits; floats do not determine more than some 30."""
    system = nsmaps.load_system("bouncing_ball", Gamma=Gamma, r=r)
    (found,) = limits(system, np.array([[1.0, 1.0]]), np.ones(2))
    assert found.label == (f"B~B/{turns}T" if turns < 30 else "unresolved")
    assert found.rests == (turns > 30)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("bouncing_ball", {"Gamma": 3.13131, "r": 0.72208}),  # in 160 digits released after 116 turns, in floats after 290 or 298
        ("vi_pair", {"d": 0.2731, "r": 0.7414, "g_bar": 0.526}),
    ],
)
def test_chaos_between_rare_rests_is_one_attractor_without_a_period(name, parameters):
    system = nsmaps.load_system(name, **parameters)
    basins = nsmaps.basins(system, np.random.default_rng(5).uniform([0.1, 0], [1.5, 6], (20, 2)), max_returns=500)
    (found,) = basins.attractors
    assert (found.label, found.period) == ("unresolved", 0)
    assert (basins.label == 0).all()


@pytest.mark.parametrize(
    ("map_of", "value", "state"),
    [
        (logistic, 3.0003, 2.0003 / 3.0003 + 1e-6),  # multiplier -1.0003
        (logistic, 3.01, 2.01 / 3.01 + 1e-12),
        (delayed, 2.001, (1.001 / 2.001 + 1e-5, 1.001 / 2.001)),  # a pair of modulus 1.0005
    ],
)
def test_an_orbit_that_leaves_a_cycle_is_no_chaos(map_of, value, state):
    (found,) = limits(map_of(value), np.reshape(state, (1, -1)), np.ones(np.size(state)))
    assert found.kind != "C"
    assert found.label in ("unresolved", "Q", "period 2")


@pytest.mark.parametrize("state", [1.0, 4.0])
def test_a_circle_map_without_critical_point_is_never_chaotic(state):
    """Near the tongue 2/15, after which a batch of returns nearly repeats: its exponent 0.00033 had an error of 0.00002."""
    turn, b = 0.25 * 23 / 37, 0.5
    kicked = Formula(
        lambda x: np.mod(x + np.arctan2(-b * np.sin(x), 1 + b * np.cos(x)) + 2 * np.pi * turn, 2 * np.pi),
        lambda x: ((1 + b * np.cos(x)) / (1 + 2 * b * np.cos(x) + b**2))[:, :, None],
        (Angle("phi"),),
    )
    (found,) = limits(kicked, np.array([[state]]), np.ones(1))
    assert found.kind == "Q"


@pytest.mark.parametrize("slope", [1.01, 1.03, 1.3])
def test_weak_chaos_has_its_name(slope):
    """Of the tent map, whose exponent is the logarithm of its slope."""
    tent = Formula(lambda x: slope * np.minimum(x, 1 - x), lambda x: np.where(x < 0.5, slope, -slope)[:, :, None])
    (found,) = limits(tent, np.array([[0.3]]), np.ones(1))
    assert (found.kind, found.exponent) == ("C", pytest.approx(np.log(slope), abs=1e-9))
