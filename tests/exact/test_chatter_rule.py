"""When impacts that accumulate are summed: one rule for impact systems and systems with modes, whatever `chatter` is."""

from functools import cache

import numpy as np
import pytest
import sympy as sp
from chattering import Held, until_rest
from messages import message
from nsmaps_bouncing_ball import BouncingBall
from systems import BallInModes

import nsmaps
from nsmaps import Guard, HybridSystem, Outcome, PoincareSection
from nsmaps.errors import StateError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.trajectory import track

SHARES = (0.0, SUMMED_SPEED, 1e-6, np.inf)
VALUES, START = {"Gamma": 1.3, "r": 0.5}, np.array([[0.3, 3.5]])


class After(BallInModes):
    """The same, seen after impacts."""

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"), side="after")


def until_release(returns, sign=1.0):
    """The number of returns up to a release, its coordinates, and the time until then."""
    n = int(np.argmax(returns.outcome == Outcome.stuck))
    assert returns.outcome[n] == Outcome.stuck
    return n, returns.image[n] * [sign, *[1] * (returns.image.shape[1] - 1)], returns.time[: n + 1].sum()


@pytest.mark.parametrize("share", SHARES[1:])
def test_impacts_are_summed_as_of_impact_systems(share):
    """The same number of single impacts, but for a sum as soon as it is exact, whose bounds on the pressure's change differ."""
    expected = BouncingBall(**VALUES).orbits(START, 80, chatter=share)
    found = BallInModes(**VALUES).orbits(START * [-1, 1], 80, derivative=True, chatter=share)
    (n, image, time), (m, other, last) = until_release(expected), until_release(found, -1)
    assert abs(n - m) <= np.isinf(share)
    assert found.words[: min(n, m)].tolist() == ["BB"] * min(n, m)
    assert found.words[m] == "B~"
    assert other == pytest.approx(image, abs=1e-15)
    assert last == pytest.approx(time, abs=4e-15)
    assert (found.derivative[m] == 0).all()


def test_fewer_impacts_are_single_the_larger_the_share():
    counts = [until_release(BallInModes(**VALUES).orbits(START * [-1, 1], 80, chatter=share))[0] for share in SHARES[1:]]
    assert counts[0] > 2 * counts[1] > 2 * counts[2] > 0
    single = BallInModes(**VALUES).orbits(START * [-1, 1], 80, chatter=0)
    assert single.words.tolist() == ["BB"] * 80
    assert abs(single.image[-1, 0]) == pytest.approx(0.5**79 * abs(single.image[0, 0]), rel=0.1)


@pytest.mark.parametrize("share", SHARES[1:])
def test_the_time_of_accumulation_is_that_of_impacts_in_60_digits(share):
    """To third order, where the ball is not released: at the latest the impact at which the sum is exact to rounding."""
    returns = BallInModes(Gamma=0.8, r=0.6).orbits([[-0.2, 1.0]], 80, chatter=share)
    n = int(np.argmax(returns.outcome == Outcome.rests))
    assert returns.outcome[n] == Outcome.rests
    expected = until_rest(0.8, 0.6, 0.2, 1.0) - 1
    assert returns.time[: n + 1].sum() == pytest.approx(float(expected), abs=2e-15)


@cache
def singly(r):
    """The release of two masses after impacts down to the default's speed, its time, and its derivative by the start."""
    returns = Held(b=0.05, w=0.3, f=1.5, d=0, r=r, k2=2.0).orbits([[0.5, 0.6, 0.1, 0.5]], 120, derivative=True)
    n, image, time = until_release(returns)
    return n, image, time, np.linalg.multi_dot([*returns.derivative[n::-1], np.eye(4)])


@pytest.mark.parametrize("r", [0.4, 0.7])
def test_a_sum_changes_no_other_state(r):
    """The second mass moves on during the impacts that are summed."""
    n, image, time, slope = singly(r)
    returns = Held(b=0.05, w=0.3, f=1.5, d=0, r=r, k2=2.0).orbits([[0.5, 0.6, 0.1, 0.5]], 60, derivative=True, chatter=np.inf)
    m, other, last = until_release(returns)
    assert 0 < m < 0.7 * n
    assert other == pytest.approx(image, abs=4e-15)
    assert last == pytest.approx(time, abs=4e-15)
    assert np.linalg.multi_dot([*returns.derivative[m::-1], np.eye(4)]) == pytest.approx(slope, abs=1e-12)


def test_impacts_at_a_section_after_them_are_single_too():
    before = BallInModes(**VALUES).orbits(START * [-1, 1], 80)
    after = After(**VALUES).orbits(START * [0.5, 1], 80)
    (n, image, time), (m, other, last) = until_release(before), until_release(after)
    assert n == m
    assert other == pytest.approx(image, abs=1e-15)
    assert last == pytest.approx(time, abs=1e-14)


class Kicked(HybridSystem):
    """A ball under constant gravity that is kicked once a period, in flight and off the floor."""

    s: float
    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -1}}

    def guards(self, t, y):
        clock, kick = sp.Rational(99, 100) - sp.cos(t - self.s), {"v": y.v + sp.Rational(1, 5)}
        return {
            "B": Guard("flight", y.x, reset={"v": -y.v / 2}, rests="floor"),
            "k": Guard("flight", clock, reset=kick),
            "l": Guard("floor", clock, to="flight", reset=kick, letter="k"),
        }

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


@pytest.mark.parametrize("s", [0.9, 1.3, 1.55, 1.6, 1.645, 1.7])
def test_no_event_falls_into_a_sum(s):
    """From -1/2 on impacts accumulate after 1; the kick comes a little before or after, where its clock hardly falls yet."""
    system = Kicked(s=s - 0.5)
    runs = [system.orbits([[-0.5, 0.0]], 60, chatter=share) for share in SHARES[1:]]
    ends = [float(run.time[: int(np.argmax(np.char.find(run.words, "k") >= 0)) + 1].sum()) for run in runs]
    kicked = [run.image[int(np.argmax(np.char.find(run.words, "k") >= 0))] for run in runs]
    assert ends == pytest.approx([ends[0]] * 3, rel=1e-13)
    assert kicked[1] == pytest.approx(kicked[0], abs=1e-13)
    assert kicked[2] == pytest.approx(kicked[0], abs=1e-13)


def test_margins_are_those_of_impact_systems():
    states = np.column_stack([np.linspace(0.05, 3, 40), np.linspace(0, 6.2, 40)])
    expected = BouncingBall(**VALUES).first_return(states, margin=True).margin
    found = BallInModes(**VALUES).first_return(states * [-1, 1], margin=True, chatter=0).margin
    assert np.isfinite(expected.slowest).sum() > 30
    assert found.slowest == pytest.approx(expected.slowest, rel=1e-12)
    assert BallInModes(**VALUES).first_return(states * [-1, 1]).margin is None


@pytest.mark.parametrize("system", [BouncingBall(**VALUES), BallInModes(**VALUES)])
def test_all_functions_of_returns_have_the_rule(system):
    state = START[0] * ([1, 1] if isinstance(system, BouncingBall) else [-1, 1])
    few = until_release(system.orbits(state[None], 80, chatter=np.inf))[0]
    start = system.orbits(state[None], few, chatter=np.inf).image[-1:]
    for share, word in ((0, "BB"), (SUMMED_SPEED, "BB"), (np.inf, "B~")):
        assert system.first_return(start, chatter=share).words == [word]
        assert system.itineraries(start, chatter=share).words[0].replace("v", "").replace("^", "")[:2] == word
        slope = system.sensitivity(start, {"Gamma": 1.0}, chatter=share)
        assert np.isfinite(slope).all() == (word == "BB" or isinstance(system, HybridSystem))
    events = [track(system, start[0], 3, chatter=share) for share in (0, np.inf)]
    speeds = [abs(one.rates[1] if hasattr(one, "rates") else one.events.before[1, 1]) for one in events]
    assert speeds[0] > 0
    assert speeds[1] == pytest.approx(0, abs=1e-15)
    number = [{"name": "n", "formula": "1", "at": "B"}]
    seen = [nsmaps.observe(system, start[0], number, n_returns=1, n_batches=1, chatter=share) for share in (0, np.inf)]
    assert seen[0].outcome == Outcome.returned
    assert seen[1].outcome == Outcome.stuck
    with pytest.raises(StateError, match=message("errors.value", name="chatter", value=-1)):
        system.first_return(start, chatter=-1)


class Bare(BallInModes):
    """The same without a contact that may last."""

    def guards(self, t, y):
        return {"B": Guard("flight", y.x, reset={"v": -self.r * y.v})}


@pytest.mark.parametrize(
    ("kind", "sign", "ended"),
    [(BouncingBall, 1, Outcome.rests), (BallInModes, -1, Outcome.rests), (Bare, -1, Outcome.accumulates)],
)
def test_chatter_that_ends_below_rounding_is_no_attractor(kind, sign, ended):
    """On a table that never throws the ball off: by basins, diagrams and the limits of orbits, however few impacts are left."""
    rng = np.random.default_rng(1)
    rows = np.column_stack([sign * 10 ** rng.uniform(-13, 0, 24), rng.uniform(0, 6.28, 24)])
    basins = nsmaps.basins(kind(Gamma=0.5, r=0.6), rows, max_returns=150)
    assert not basins.attractors
    assert set(basins.outcome.tolist()) == {ended}
    diagram = nsmaps.bifurcation_diagram(
        lambda gamma: kind(Gamma=gamma, r=0.6), "gamma", np.linspace(0.4, 0.6, 3), rows[:3], direction="down"
    )
    assert not diagram.held.any()
    run = kind(Gamma=0.5, r=0.6).orbits(rows[:1], 100)
    n = int(np.argmax(run.outcome == ended))
    (reason,) = kind(Gamma=0.5, r=0.6).reasons(run.start[n : n + 1])
    assert ("declare `rests=` in the guard" in reason) == (kind is Bare)
