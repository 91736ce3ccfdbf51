"""The windows of a bifurcation diagram end at the events of branches, or where the motion of an orbit changes."""

import numpy as np
import pytest
from systems import Cam

from nsmaps import PiecewiseMap, bifurcation_diagram, continue_branch, load_system, orbit, periodic_orbit
from nsmaps.dynamics.diagrams.borders import LOCATED, CycleSearch, Located
from nsmaps.dynamics.diagrams.changes import CHANGED
from nsmaps.dynamics.diagrams.windows import windows
from nsmaps.exact import Along


def swept(system, low, high, count, start, direction, discard=800, returns=60):
    map_of = Along(system, "d")
    made = bifurcation_diagram(
        map_of, "p", np.linspace(low, high, count), start, n_returns=returns, transient=discard, direction=direction
    )
    return map_of, made, windows(made, map_of, np.array(start), discard, direction)


@pytest.fixture(scope="module")
def paper():
    return load_system("vi_pair", d=0.35, r=0.5, M=0.1245, g=9.8, beta=np.pi / 3, F=5)


@pytest.fixture(scope="module")
def doubling(paper):
    """The period doubling of the branch of 1:1."""
    branch = continue_branch(paper, "d", periodic_orbit(paper, [0.83, 0.36]), 0.35, (0.28, 0.35), direction="down")
    (found,) = branch.of_kind("period doubling")
    return found


@pytest.mark.parametrize("direction", ["up", "down", None])
@pytest.mark.parametrize("count", [60, 301])
def test_a_border_is_the_period_doubling_of_the_branch(paper, doubling, count, direction):
    *_, found = swept(paper, 0.28, 0.35, count, [0.83, 0.36], direction, discard=2000)
    assert [window.label for window in found] == ["1:1/2T", "1:1/T"]
    assert [window.by_returns for window in found] == ["1:1, period 2", "1:1, period 1"]
    doubled, single = found
    assert (doubled.high.kind, single.low.kind) == ("period halving", "period doubling")
    for border in (doubled.high, single.low):
        assert border.value == pytest.approx(doubling.value, abs=2 * border.precision + doubling.precision)
        assert border.precision <= LOCATED * 0.07
    assert (doubled.low.kind, doubled.low.value, single.high.value) == ("end of the range", 0.28, 0.35)


def test_folds_grazes_and_crises_are_where_the_documentation_has_them():
    """Followed up, a motion 2:1 goes on to its fold; followed down, chaos goes on to its crisis."""
    system = load_system("vi_pair", d=0.2265, r=0.25, M=0.1245, g=9.8, beta=np.pi / 6, F=5)
    (_, _, up), (_, _, down) = (
        swept(system, 0.2, 0.24, 161, [0.6, 0.3], way, discard=4000, returns=120) for way in ("up", "down")
    )
    two, *_, single = up
    assert (two.label, two.high.kind) == ("2:1/T", "fold")
    assert two.high.value == pytest.approx(0.227713761, abs=1e-9)
    assert single.low.value == pytest.approx(0.234583791, abs=1e-9)
    doubled = next(window for window in up if window.label == "1:1/2T")
    assert (doubled.low.kind, doubled.low.value) == ("grazing", pytest.approx(0.230488317, abs=1e-9))
    crisis = down[0].high
    assert (crisis.kind, crisis.precision < 1e-4) == ("change of motion", True)
    assert crisis.value == pytest.approx(0.22505, abs=crisis.precision + 1e-5)


def test_values_without_a_map_are_a_window_without_a_motion(paper):
    _, _, found = swept(paper, -0.02, 0.02, 41, [0.83, 0.36], None, discard=50)
    assert (found[0].label, found[0].low.kind) == ("", "end of the range")
    assert found[0].high.value == pytest.approx(0, abs=CHANGED * 0.04)


def test_a_diagram_of_few_values_has_no_windows(paper):
    assert swept(paper, 0.33, 0.35, 3, [0.83, 0.36], None)[2] == ()


@pytest.mark.thorough
def test_rests_without_restitution_begin_and_end_where_flights_do():
    """A ball without restitution rests until sin(phase) = 1/Gamma, and flies from there; times are those of its parabola."""
    from scipy.optimize import brentq

    def landing(gamma, phase):
        height = lambda s: gamma * (np.sin(phase) + np.cos(phase) * s - np.sin(phase + s)) - s * s / 2  # noqa: E731
        times = np.linspace(0.5, 4 * gamma, 400)
        k = int(np.argmax(np.array([height(s) for s in times]) < 0))
        return (phase + brentq(height, times[k - 1], times[k], xtol=1e-14)) % (2 * np.pi)

    begins = brentq(lambda g: landing(g, landing(g, np.arcsin(1 / g))) - np.arcsin(1 / g), 3.8, 3.9)  # it lands at the release
    ends = brentq(lambda g: np.sqrt(g * g - 1) - 1.5 * np.pi + np.arcsin(1 / g), 4, 5)  # the first flight ends at rest
    system = load_system("bouncing_ball", Gamma=4.0, r=0.0)
    map_of = Along(system, "Gamma")
    start = [4.19, 0.63]
    made = bifurcation_diagram(map_of, "p", np.linspace(3.75, 4.75, 34), start, n_returns=40, transient=200, direction="up")
    free, twice, once = windows(made, map_of, np.array(start), 200, "up")
    assert [each.label for each in (free, twice, once)] == ["1:0/2T", "BB B_B/2T", "B_B/2T"]
    for border, value in ((free.high, begins), (twice.low, begins), (twice.high, ends), (once.low, ends)):
        assert abs(border.value - value) <= border.precision <= 1e-6


class Logistic(PiecewiseMap):
    """x -> a x (1 - x)."""

    a: float
    coordinates = ("x",)

    def pieces(self, x):
        return {"A": (True, {"x": self.a * x.x * (1 - x.x)})}


def test_chaos_ends_where_the_cycle_is_born_from_which_a_window_has_doubled():
    """At 3.606 the ten-cycle, born by a fold at 3.60520806689352951353 (40 digits), has doubled at 3.60591693226942."""
    values = [3.6033, 3.6037, 3.6041, 3.6045, 3.6049, 3.606, 3.6065, 3.607, 3.6075, 3.608]
    made = bifurcation_diagram(Logistic(a=3.6), "a", values, [0.3], direction="up", borders=True)
    before, after = made.windows
    assert (before.high.kind, before.high.precision < 1e-8) == ("fold", True)
    assert abs(before.high.value - 3.60520806689352951353) <= before.high.precision
    assert after.low.kind == "accumulation of period doublings from AAAAAAAAAA, period 10 on"


@pytest.mark.parametrize("direction", ["up", "down"])
def test_the_onset_of_chaos_is_a_border_though_a_narrow_window_follows(direction):
    """Doublings accumulate at 3.569945671870944901842 (Feigenbaum); at 3.571572 there is a cycle of forty states."""
    values = [*np.linspace(3.5, 3.566, 12), 3.5702, 3.5706, 3.571572, 3.58, 3.59, 3.6]
    made = bifurcation_diagram(Logistic(a=3.5), "a", values, [0.3], transient=1000, direction=direction, borders=True)
    chaos = made.windows[1]
    assert (chaos.label, chaos.low.kind) == ("C", "accumulation of period doublings from AAAA, period 4 on")
    assert abs(chaos.low.value - 3.569945671870944901842) <= chaos.low.precision < 1e-6


def test_a_window_of_affine_pieces_between_two_values_is_no_chaos():
    """R doubles at a_R = -1, and LR, born there, at a_L a_R = -1, before the next value of the diagram."""
    skew = load_system("border_collision_1", a_L=0.97, a_R=-1.5, mu=1.0)
    values = np.linspace(-1.9, -0.5, 14)
    made = bifurcation_diagram(skew, "a_R", values, [0.1], n_returns=200, borders=True, direction="down")
    chaos, fixed = made.windows
    assert (chaos.label, fixed.label) == ("C", "R, period 1")
    assert chaos.high.value == pytest.approx(-1 / 0.97, abs=1e-13)
    assert fixed.low.value == pytest.approx(-1, abs=1e-13)


def test_a_doubled_cycle_ends_at_a_halving_where_a_step_ends_beside_it():
    """The cycle of nine states doubles at 3.687274210536; the last step ends 2e-12 above, where det(M - 1) has passed zero."""
    value, cycles = 3.687290969899666, CycleSearch(Along(Logistic(a=3.6), "a"), "a", np.array([0.89952758]), 0.2)
    cycle = cycles.at(value, orbit(Logistic(a=value), [0.4979732122095169], 17).states)
    end = cycles.end(Located(value, cycle), 3.6746, 0.0006688963210702347)
    assert (end.border.kind, len(end.half.cycle.states)) == ("period halving", 9)
    assert abs(end.border.value - 3.687274210536) < 1e-12


@pytest.mark.parametrize(
    ("system", "name", "low", "high"),
    [
        (load_system("bouncing_ball", Gamma=1.2, r=0.4), "Gamma", 1.05, 1.95),
        pytest.param(  # beyond is a cycle with a fold
            Cam(w=70.0, r=0.4, k=100, c=0.5, preload=40, a=0.01, b=0.002), "w", 70.0, 80.0, marks=pytest.mark.thorough
        ),
    ],
)
def test_complete_chatter_once_a_period_ends_where_orbits_leave_it(system, name, low, high):
    """Orbits rest once a period before the border, whatever the number of impacts summed, and at other times beyond."""
    made = bifurcation_diagram(system, name, np.linspace(low, high, 19), [0.1, 1.0], transient=300, direction="up", borders=True)
    window = made.windows[0]
    assert (window.label, window.high.kind, window.high.precision < 1e-4 * high) == ("B~B/T", "change of motion", True)

    def rests_once(value):
        moved, k = system.at(**{name: value}), int(np.searchsorted(made.values, value)) - 1
        settled = orbit(moved, made.states[k, 0, -1], 1000).final
        path = orbit(moved, settled, 200)
        turns = path.turns[:, 1].cumsum()[[word.endswith("~") for word in path.words]]
        return turns.size > 2 and (np.diff(turns) == 1).all()

    assert rests_once(window.high.value - 2 * window.high.precision)
    assert not rests_once(window.high.value + 2 * window.high.precision)
