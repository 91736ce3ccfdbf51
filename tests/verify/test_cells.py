"""Cells whose orbits reach a trap: found in floats, verified with all rounding, refused where anything is changed."""

from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest

import nsmaps
from nsmaps.errors import ProofError

pytest.importorskip("flint")

from nsmaps_bouncing_ball import BouncingBall

from nsmaps.proof.cells import FINEST, base_grids, codes_of, search
from nsmaps.proof.flights import OPEN, SPLIT
from nsmaps.proof.formula import equation_of, flow_of
from nsmaps.verify.cells import Grid, Refused, check_cells
from nsmaps.verify.formula import system_of, tables_of

POINT = np.array([0.363611564551622, 0.833385990208561])  # phase and speed of the stable fixed point at d = 0.35
GRID = Grid(side=256, depth=0, top=1.125, periods=2, closed=False)
N = GRID.side * FINEST
DAMPED = {"zeta": 0.1, "w": 0.8, "A": 1.0, "wall": 0.4, "r": 0.7}


def near(wall, phases, n, speeds):
    """A box around the fixed point as a trap; that its orbits converge is not the subject here."""
    off = np.abs(np.concatenate([phases * (2 * np.pi / n) - POINT[0], np.pi * (speeds - POINT[1])], 1))
    return (off < 0.09).all(1) & (np.asarray(wall) == 0)


def found(equation, flow=None):
    flow = flow or flow_of(equation, N, N // GRID.side, GRID.periods, GRID.top)
    cells = search(
        flow, base_grids(2, GRID.side, N, GRID.top), GRID.depth, lambda wall, phases, speeds: near(wall, phases, N, speeds)
    )
    return codes_of(cells)


@pytest.fixture(scope="module")
def pair():
    return nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113275)


@pytest.fixture(scope="module")
def equation(pair):
    return equation_of(pair)


@pytest.fixture(scope="module")
def codes(equation):
    return found(equation)


def test_what_is_found_is_verified(equation, codes):
    shares = check_cells(system_of(equation), GRID, codes, near).proved
    assert shares == pytest.approx([np.mean(part < OPEN) for part in codes.reshape(2, -1)])
    assert shares[0] > 0.5


@pytest.mark.parametrize("wrong", ["order", "open cell", "flipped bit", "restitution", "wall", "trap", "length", "speed"])
def test_changes_are_refused(equation, codes, wrong):
    codes, grid, trap = codes.copy(), GRID, near
    late = int(np.argmax(np.where(codes < SPLIT, codes, 0)))
    match wrong:
        case "order":
            codes[late] = 1
        case "open cell":
            codes[np.flatnonzero(codes == OPEN)[7]] = 60000
        case "flipped bit":
            codes[late] ^= 1 << int(codes[late]).bit_length() - 1
        case "restitution":
            equation = {**equation, "restitution": ["0.51", "0"]}
        case "wall":
            equation = {**equation, "walls": [{**wall, "at": [str(0.18 * wall["side"]), "0"]} for wall in equation["walls"]]}
        case "trap":
            trap = lambda wall, phases, n, speeds: near(wall, phases, n, speeds) & (speeds[:, 0] > POINT[1])  # noqa: E731
        case "length":
            codes = codes[:-1]
        case "speed":
            grid = grid._replace(top=1.0)
    with pytest.raises(Refused):
        check_cells(system_of(equation), grid, codes, trap)


def test_an_error_in_the_search_is_found(equation):
    flow = flow_of(equation, N, N // GRID.side, GRID.periods, GRID.top)
    phases = flow.phases.copy()
    phases[300, 2] += 1.0  # the force at one phase
    with pytest.raises(Refused, match="later in cells of a lower order"):
        check_cells(system_of(equation), GRID, found(equation, flow._replace(phases=phases)), near)


def test_orbits_from_certified_cells_descend(pair, codes):
    """Impacts by the engine, from 200 states of certified cells of the base wall: each is in a cell of a lower order."""
    rng = np.random.default_rng(5)
    orders = codes.reshape(2, GRID.side, GRID.side).astype(int)
    steps = 0
    for column, row in rng.permutation(np.argwhere((orders[0] > 0) & (orders[0] < SPLIT)))[:200]:
        state = np.array([(row + rng.random()) * GRID.top, (column + rng.random()) * 2 * np.pi]) / GRID.side
        impacts = pair.impacts(state, 6, chatter=0)
        cells = [
            orders[wall, int(phase % (2 * np.pi) / (2 * np.pi) * GRID.side), int(speed / GRID.top * GRID.side)]
            for wall, phase, speed, mark in zip(impacts.wall, impacts.phase, impacts.speed, impacts.mark, strict=True)
            if not mark
        ]
        assert cells[0] == orders[0, column, row]
        for now, after in pairwise(cells):
            if now == 0:
                break
            assert after < now or (after == now and row == 0)
            steps += 1
    assert steps > 300


@pytest.mark.parametrize(("name", "values"), [("vi_pair", {"d": 0.35, "g_bar": 0.2}), ("impact_oscillator", DAMPED)])
def test_tables_hold_flights_in_60_digits(name, values):
    """The place and velocity of a flight from tables, against the differential equation solved by mpmath."""
    data = equation_of(nsmaps.load_system(name, **values))
    system, n = system_of(data), 1024
    tables = tables_of(system, n, 16, 2, 1.0)
    with mp.workdps(60):
        b, k, g, cosine, sine = (mp.mpf(data[x][0]) for x in ("damping", "stiffness", "force", "cosine", "sine"))
        w = mp.mpf(data["frequency"][0]) * mp.pi ** data["frequency"][2]
        i, m, z0, w0 = 300, 100, mp.mpf(data["walls"][0]["at"][0]), mp.mpf("-0.7")
        t0, step = 2 * mp.pi * i / n / w, 2 * mp.pi / n / w
        push = lambda t, y: [y[1], g + cosine * mp.cos(w * t) + sine * mp.sin(w * t) - k * y[0] - b * y[1]]  # noqa: E731
        with mp.workdps(30):
            z, v = mp.odefun(push, t0, [z0, w0])(t0 + m * step)
        (p0, dp0, _), (p1, dp1, _) = tables.phases[i], tables.phases[(i + m) % n]
        a, da, fall = tables.flights[tables.before + m]
        c, x, y = da + float(b) * a, float(z0) - p0, float(w0) - dp0
        assert abs(p1 + fall + x * c + y * a - z) < 40 * tables.size**2 * (tables.eps + 1e-16)
        assert abs(dp1 + float(g) * a - x * float(k) * a + y * da - v) < 40 * tables.size**2 * (tables.eps + 1e-16)


def test_bounds_hold_at_random_flights():
    """The derivative of the acceleration and the second derivatives of z' by the departure, by differences in 60 digits."""
    data = equation_of(nsmaps.load_system("impact_oscillator", **DAMPED))
    tables = tables_of(system_of(data), 256, 32, 1, 1.0)
    rng = np.random.default_rng(2)
    with mp.workdps(60):
        b, k, cosine, sine, w = (mp.mpf(data[x][0]) for x in ("damping", "stiffness", "cosine", "sine", "frequency"))
        at = mp.mpf(data["walls"][0]["at"][0])
        d, e = k - w**2, b * w
        p, q = (d * cosine - e * sine) / (d**2 + e**2), (d * sine + e * cosine) / (d**2 + e**2)
        root = mp.sqrt(k - b**2 / 4)
        free = lambda s: mp.exp(-b * s / 2) * mp.sin(root * s) / root  # noqa: E731
        steady = lambda t: p * mp.cos(w * t) + q * mp.sin(w * t)  # noqa: E731

        def velocity(t0, t1, speed):
            z = lambda t: (  # noqa: E731
                steady(t)
                + (at - steady(t0)) * (mp.diff(free, t - t0) + b * free(t - t0))
                + (-speed - mp.diff(steady, t0)) * free(t - t0)
            )
            return mp.diff(z, t1)

        for _ in range(6):
            t0, s, speed = (mp.mpf(float(x)) for x in rng.random(3) * [7.8, 7.0, 0.7])
            names = ((2, 0), (1, 1), (0, 2))
            found = [abs(mp.diff(lambda x, y, u=speed: velocity(x, y, u), (t0, t0 + s), order)) for order in names]
            assert all(value <= bound for value, bound in zip(found, tables.bounds[2:5], strict=True))


def test_other_impact_laws_are_refused():
    class Softer(BouncingBall):
        def rebound(self, speed, wall):
            return self.r * speed / (1 + speed)

    with pytest.raises(ProofError, match="constant share of their speed"):
        equation_of(Softer(Gamma=1.2))
