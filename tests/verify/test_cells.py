"""Cells whose orbits reach a trap: found in floats, verified with all rounding, refused where anything is changed."""

from itertools import pairwise
from typing import NamedTuple

import mpmath as mp
import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.errors import ProofError

pytest.importorskip("flint")

from nsmaps_bouncing_ball import BouncingBall

from nsmaps.proof.arrivals import CUT, OPEN, SPLIT
from nsmaps.proof.cells import FINEST, base_grids, codes_of, search
from nsmaps.proof.formula import equation_of, flow_of
from nsmaps.verify.cells import CertificateError, Grid, check_cells, tree_of
from nsmaps.verify.formula import system_of, tables_of

POINT = np.array([0.363611564551622, 0.833385990208561])  # phase and speed of the stable fixed point at d = 0.35
GRID = Grid(side=256, depth=0, top=1.125, periods=2, closed=False)
N = GRID.side * FINEST
CUTS = 2  #: into strips
DAMPED = {"zeta": 0.1, "w": 0.8, "A": 1.0, "wall": 0.4, "r": 0.7}


class Found(NamedTuple):
    codes: np.ndarray
    slopes: np.ndarray
    shares: np.ndarray


def near(wall, phases, n, speeds):
    """A box around the fixed point as a trap; that its orbits converge is not the subject here."""
    off = np.abs(np.concatenate([phases * (2 * np.pi / n) - POINT[0], np.pi * (speeds - POINT[1])], 1))
    return (off < 0.09).all(1) & (np.asarray(wall) == 0)


def found(equation, flow=None):
    flow = flow or flow_of(system_of(equation), N, N // GRID.side, GRID.periods, GRID.top)
    inside = lambda wall, phases, speeds: near(wall, phases, N, speeds)  # noqa: E731
    shares = []
    progress = lambda level, found: shares.append(found) or True  # noqa: E731
    cells = search(flow, base_grids(2, GRID.side, N, GRID.top), GRID.depth, inside, progress, CUTS)
    return Found(*codes_of(cells), shares[-1])


@pytest.fixture(scope="module")
def pair():
    return nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113275)


@pytest.fixture(scope="module")
def equation(pair):
    return equation_of(pair)


@pytest.fixture(scope="module")
def cells(equation):
    return found(equation)


def test_what_is_found_is_verified(equation, cells):
    """With the same shares, more than the squares before they are cut: at the latest those are open whose code is CUT."""
    shares = check_cells(system_of(equation), GRID, cells.codes, near, slopes=cells.slopes).proved
    assert shares == pytest.approx(cells.shares)
    whole = [np.mean(part < CUT) for part in cells.codes[: 2 * GRID.side**2].reshape(2, -1)]
    assert (shares > np.array(whole) + 0.05).all()
    assert whole[0] > 0.5


@pytest.mark.parametrize(
    "wrong", ["order", "open cell", "flipped bit", "restitution", "wall", "trap", "length", "speed", "slope", "slopes"]
)
def test_changes_are_refused(equation, cells, wrong):
    codes, slopes, grid, trap = cells.codes.copy(), cells.slopes.copy(), GRID, near
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
        case "slope":
            strips = np.sort(codes[-4 * len(slopes) :].reshape(-1, 4))  # each square is cut into four
            slopes[np.argmax(np.where(strips[:, 3] < CUT, 0, np.where(strips[:, 0] < CUT, strips[:, 0], 0)))] *= -1
        case "slopes":
            slopes = slopes[:-1]
    with pytest.raises(CertificateError):
        check_cells(system_of(equation), grid, codes, trap, slopes=slopes)


def test_a_speed_of_too_many_bits_is_refused_as_it_is_stated(equation, cells):
    with pytest.raises(CertificateError, match=message("verify.grid", top=1000.0000001)):
        check_cells(system_of(equation), GRID._replace(top=1000.0000001), cells.codes, near, slopes=cells.slopes)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("lowest row", message("verify.split")),
        ("no slope", message("verify.no-slope")),
        ("split strip", message("verify.split")),
    ],
)
def test_divisions_that_are_not_meant_are_refused(wrong, said):
    codes, slopes = np.full(2 * GRID.side**2 + 2, OPEN, np.uint16), np.array([3], np.int8)
    match wrong:
        case "lowest row":
            codes[0] = CUT
        case "no slope":
            codes[1], slopes = CUT, np.zeros(1, np.int8)
        case "split strip":
            codes[1], codes[-1] = CUT, SPLIT
    with pytest.raises(CertificateError, match=said):
        tree_of(GRID, 2, codes, slopes)


@pytest.mark.thorough
def test_an_error_in_the_search_is_found(equation):
    flow = flow_of(system_of(equation), N, N // GRID.side, GRID.periods, GRID.top)
    phases = flow.phases.copy()
    phases[300, 2] += 1.0  # the force at one phase
    wrong = found(equation, flow._replace(phases=phases))
    with pytest.raises(CertificateError, match=message("verify.order")):
        check_cells(system_of(equation), GRID, wrong.codes, near, slopes=wrong.slopes)


def leaf_at(tree, wall, phase, speed):
    """The cell of a state, from the definition of squares and strips."""
    at = phase % (2 * np.pi) / (2 * np.pi) * tree.n
    node = (wall * tree.side + int(at * tree.side / tree.n)) * tree.side + int(speed / tree.top * tree.side)
    while tree.child[node] >= 0:
        child = tree.child[node]
        level = speed - tree.slope[child] * (at - tree.first[child] - tree.width[child] / 2)
        assert tree.low[child] <= level <= tree.high[child + 1]
        node = child + int(level >= tree.high[child])
    return node


def test_orbits_from_certified_cells_descend(pair, cells):
    """Impacts by the engine, from 600 states of certified squares and strips: each is in a cell of a lower order."""
    rng = np.random.default_rng(5)
    tree, steps, strips = tree_of(GRID, 2, cells.codes, cells.slopes), 0, 0
    for phase, speed in rng.random((1200, 2)) * [2 * np.pi, GRID.top]:
        start = leaf_at(tree, 0, phase, speed)
        if not 0 < tree.order[start] < CUT:
            continue
        impacts = pair.impacts([speed, phase], 6, chatter=0)
        found = zip(impacts.wall, impacts.phase, impacts.speed, impacts.mark, strict=True)
        nodes = [leaf_at(tree, int(wall), phase, speed) for wall, phase, speed, mark in found if not mark]
        assert nodes[0] == start
        for now, after in pairwise(nodes):
            if tree.order[now] == 0:
                break
            assert tree.order[after] < tree.order[now] or (after == now and tree.row[now] == 0)
            steps, strips = steps + 1, strips + int(tree.slope[now] != 0)
    assert steps > 1000
    assert strips > 100


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

    with pytest.raises(ProofError, match=message("proof.share-of-speed")):
        equation_of(Softer(Gamma=1.2))
