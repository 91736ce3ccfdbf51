"""First returns against 50-digit references, and the fixed points, cycles and chatter that are known of the exact map."""

from functools import partial
from math import pi

import mpmath as mp
import numpy as np
import pytest

from nsmaps.dynamics.orbit import orbit
from nsmaps.exact.outcome import Outcome

TILT = {"pi/3": pi / 3, "pi/6": pi / 6}
#: what "next to a graze" allows: the map's square root there turns a rounding of the start into its root
TOLERANCE = {"ordinary": 1e-13, "tiny": 1e-13, "graze": 1e-8}


def returned(pair, row):
    system = pair(row["d"], row["r"], TILT[row["beta"]])
    return system.first_return([[row["v"], row["phi"]]])


@pytest.mark.parametrize(("name", "rows"), [("first_returns", 80), ("hard_returns", 60)])
def test_every_reference(pair, reference, name, rows):
    table = reference(name)
    assert len(table) == rows
    for row in table:
        got = returned(pair, row)
        tolerance = TOLERANCE[row.get("kind", "ordinary")]
        assert got.words[0] == row["word"], row
        assert got.outcome[0] == Outcome.returned, row
        assert abs(got.image[0, 0] - float(row["v1"])) <= tolerance, row
        assert abs(got.image[0, 1] - float(row["phi1"])) <= tolerance, row


def test_slow_impacts_keep_relative_accuracy(pair, reference):
    slow = [row for row in reference("hard_returns") if row["kind"] == "tiny"]
    assert {row["v"] for row in slow} >= {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}
    for row in slow:
        assert returned(pair, row).image[0, 0] == pytest.approx(float(row["v1"]), rel=1e-11)
        assert returned(pair, row).time[0] == pytest.approx(float(row["dt"]), rel=1e-11)


def test_fixed_point(pair):
    end = orbit(pair(0.35), [0.2, 0.1], 300, chatter=np.inf).final
    assert end == pytest.approx([0.83338599, 0.36361156], abs=1e-8)
    assert end == pytest.approx([0.833385990208561209, 0.363611564551621959], abs=1e-13)


def test_two_cycle(pair):
    states = orbit(pair(0.30), [0.2, 0.1], 400).states[-2:]
    states = states[np.argsort(states[:, 0])]
    assert states == pytest.approx(np.array([[0.730550, 0.222750], [0.810226, 0.412905]]), abs=1e-6)


def test_chatter_sticks_and_is_released(pair):
    system = pair(0.35)
    path = orbit(system, [0.2, 0.1], 150, chatter=np.inf)
    assert path.states[1] == pytest.approx([0.094462, 0.639448], abs=1e-6)
    k = int(np.flatnonzero(path.words == "B~")[0])
    assert set(path.words[:k]) == {"BB"}
    with mp.workdps(30):
        release = float(mp.acos(-mp.mpf(system.g_bar)))
    assert path.states[k + 1] == pytest.approx([0, release], abs=1e-14)
    assert path.words[k + 1] == "BTB"
    assert path.final == pytest.approx([0.83338599, 0.36361156], abs=1e-8)


def test_chatter_summed_is_chatter_followed_impact_by_impact(pair):
    """The phase at which impacts accumulate, 1.36641 from (0.2, 0.1): by the sum, and by 980 single impacts."""
    system = pair(0.35)
    every = orbit(system, [0.2, 0.1], 1000, chatter=0)
    assert set(every.words[:980]) == {"BB"}
    last = every.states[980]
    assert last[0] < 1e-290
    assert last[1] == pytest.approx(1.36641, abs=1e-5)
    path = orbit(system, [0.2, 0.1], 60, chatter=np.inf)
    k = int(np.flatnonzero(path.words == "B~")[0])
    start = path.states[k]
    summed = system.first_return([start], chatter=np.inf)
    waited = (summed.lifted[0, 1] - last[1]) / pi
    assert summed.time[0] == pytest.approx((last[1] - start[1]) / pi + waited, abs=1e-13)
    x = accumulation(system, *start)
    assert start[1] + pi * x == pytest.approx(last[1], abs=1e-13)


def accumulation(system, v, phi, n=300):
    """Time until the impacts accumulate, by following them in 40 digits."""
    with mp.workdps(40):
        g, r = mp.mpf(system.g_bar), mp.mpf(system.r)
        v, psi, total = mp.mpf(float(v)), mp.mpf(float(phi)), mp.mpf(0)

        def mean_velocity(s, w, psi):
            bend = (mp.cos(mp.pi * s + psi) - mp.cos(psi)) / (mp.pi**2 * s)
            return w - mp.sin(psi) / mp.pi + g * s / 2 - bend

        for _ in range(n):
            w = -r * v
            guess = -2 * w / (g + mp.cos(psi))
            s = mp.findroot(partial(mean_velocity, w=w, psi=psi), guess, tol=1e-60, verify=False)
            v = w + g * s + (mp.sin(mp.pi * s + psi) - mp.sin(psi)) / mp.pi
            psi, total = psi + mp.pi * s, total + s
            if v < mp.mpf(10) ** -35:
                break
        return float(total)


@pytest.mark.parametrize(("d", "attractor"), [(0.35, 1), (0.30, 2)])
def test_every_start_arrives(pair, d, attractor):
    """300 x 300 starts over v in (0, 1.5], phi in [0, 2 pi): none lost, all on the attractor after 100 returns."""
    system = pair(d)
    v, phi = np.meshgrid(np.linspace(1.5 / 300, 1.5, 300), np.linspace(0, 2 * pi, 300, endpoint=False))
    states = np.column_stack([v.ravel(), phi.ravel()])
    for _ in range(100):
        returns = system.first_return(states, chatter=np.inf)
        assert returns.valid.all()
        assert np.isin(returns.outcome, [Outcome.returned, Outcome.stuck]).all()
        states = returns.image
    cycle = orbit(system, [0.83, 0.36], 600).states[-attractor:]
    distance = np.min([np.abs(states - point).max(axis=1) for point in cycle], axis=0)
    assert distance.max() < 1e-6


def test_determinant_over_a_return_is_a_power_of_restitution(pair):
    rng = np.random.default_rng(1)
    states = np.column_stack([rng.uniform(0.05, 1.2, 2000), rng.uniform(0, 2 * pi, 2000)])
    returns = pair(0.3).first_return(states, derivative=True)
    impacts = np.array([len(word) - 1 for word in returns.words])
    product = np.linalg.det(returns.derivative) * returns.image[:, 0] / states[:, 0]
    ordinary = np.abs(returns.derivative).max(axis=(1, 2)) < 100
    assert ordinary.sum() > 1500
    assert product[ordinary] == pytest.approx(0.5 ** (2 * impacts[ordinary]), rel=1e-9)


def test_multipliers_of_the_fixed_point(pair):
    state = [[0.833385990208561209, 0.363611564551621959]]
    multipliers = np.linalg.eigvals(pair(0.35).first_return(state, derivative=True).derivative[0])
    assert np.sort(multipliers) == pytest.approx([-0.82672902, -0.07559914], abs=1e-8)


@pytest.mark.parametrize(
    ("state", "multipliers", "word"),
    [
        ((0.281770025375305, 2.91844362963194), (-0.0275, -9.106), "BB"),
        ((0.343255510718990, 2.87685171619735), (4.8e-4, 129.95), "BTB"),
    ],
)
def test_saddles(pair, state, multipliers, word):
    returns = pair(0.35).first_return([state], derivative=True)
    assert returns.words[0] == word
    assert returns.image[0] == pytest.approx(state, abs=1e-11)
    found = np.linalg.eigvals(returns.derivative[0])
    assert sorted(found, key=abs) == pytest.approx(multipliers, rel=2e-3)
