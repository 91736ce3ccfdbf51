"""Every function that takes balls holds what is true at the points of the balls: random balls and points, 60 digits by mpmath."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message

pytest.importorskip("flint")

from flint import arb, ctx
from motion import Equation, flight, free, landed, seen

from nsmaps.verify.certificate import read
from nsmaps.verify.cycles import krawczyk, verified
from nsmaps.verify.cycles import stated_of as cycle_of
from nsmaps.verify.flights import inverse_of, next_impact, next_impacts, times
from nsmaps.verify.formula import System, UnprovedError, ball, free_motion, harmonic_motion, system_of, tables_of
from nsmaps.verify.horseshoe import covers, entropy, horseshoe_of
from nsmaps.verify.trap import carried, contraction, trap_of

KEPT = Path(__file__).parents[2] / "docs" / "certificates"
KINDS = (
    "free fall",
    "no stiffness",
    "stiffness across zero",
    "critical",
    "across critical",
    "near critical",
    "under",
    "over",
    "saddle",
)
WIDE = (0.0, 1e-15, 1e-9, 1e-4)  #: radii
SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(autouse=True)
def digits(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """60 digits, and flights of balls are given up early."""
    monkeypatch.setattr("nsmaps.verify.flights.MOST", 200)
    with mp.workdps(60):
        yield


def entry(rng: np.random.Generator, value: float, radius: float | None = None) -> list[str]:
    """A decimal near a value, and a radius."""
    return [repr(round(value, 8)), repr(float(rng.choice(WIDE) if radius is None else radius))]


def damped(rng: np.random.Generator, kind: str) -> tuple[list[str], list[str]]:
    """Damping and stiffness of a kind."""
    b = float(rng.choice([0.01, 0.3, 2.0, 5.0, 20.0])) * rng.uniform(0.5, 1.5)
    match kind:
        case "free fall":
            return ["0", "0"], ["0", "0"]
        case "no stiffness":
            return entry(rng, b, 0.0), ["0", "0"]
        case "stiffness across zero":
            return rng.choice([["0", "0"], entry(rng, b, 1e-6)]).tolist(), entry(rng, rng.uniform(-1e-5, 1e-5), 1e-4)
        case "critical":
            return ["2", "0"], ["1", "0"]
        case "across critical":
            b = round(b, 4)
            return [repr(b), repr(1e-7 * b)], entry(rng, b * b / 4, 1e-6)
        case "near critical":
            b = round(b, 4)
            return [repr(b), "0"], entry(rng, b * b / 4 + float(rng.choice([-1e-6, 1e-6])), 1e-7)
        case "under":
            return entry(rng, 0.1 * b), entry(rng, b * b + rng.uniform(0.2, 4))
        case "over":
            return entry(rng, b), entry(rng, b * b / 4 * rng.uniform(0.01, 0.9))
    return entry(rng, b), entry(rng, -rng.uniform(0.1, 1))


def stated(rng: np.random.Generator, kind: str) -> dict[str, Any]:
    """A system as a certificate states it, of one wall or two."""
    walls = [{"at": entry(rng, 0.4), "side": 1}, {"at": entry(rng, -0.3), "side": -1}][:: int(rng.choice([-1, 1]))]
    damping, stiffness = damped(rng, kind)
    return {
        "damping": damping,
        "stiffness": stiffness,
        "force": rng.choice([["0", "0"], entry(rng, rng.normal())]).tolist(),
        "cosine": entry(rng, rng.normal()),
        "sine": rng.choice([["0", "0"], entry(rng, rng.normal())]).tolist(),
        "frequency": [*entry(rng, rng.uniform(0.7, 3)), int(rng.integers(2))],
        "restitution": entry(rng, rng.uniform(0.2, 0.95)),
        "walls": walls[: int(rng.integers(1, 3))],
    }


def point(rng: np.random.Generator, number: list[Any]) -> Any:
    """A number within a ball, often at its end."""
    return mp.mpf(number[0]) + mp.mpf(number[1]) * mp.mpf(float(rng.choice([-1, 1, rng.uniform(-1, 1)])))


def equation(rng: np.random.Generator, data: dict[str, Any]) -> Equation:
    """One of the systems of a certificate."""
    names = ("damping", "stiffness", "force", "cosine", "sine", "frequency")
    b, k, g, cosine, sine, w = (point(rng, data[name]) for name in names)
    walls = tuple((point(rng, wall["at"]), wall["side"]) for wall in data["walls"])
    return Equation(b, k, g, cosine, sine, w * mp.pi ** data["frequency"][2], walls, point(rng, data["restitution"]))


def exact(x: Any) -> arb:
    """A number of mpmath as a ball with the error of its last digits."""
    return arb(mp.nstr(x, 45))


def within(rng: np.random.Generator, x: arb) -> Any:
    """A double within a ball, as a number of mpmath."""
    return mp.mpf(float(x.mid())) + mp.mpf(float(x.rad())) * mp.mpf(float(rng.uniform(-1, 1)))


@given(st.sampled_from(KINDS), SEEDS)
@settings(max_examples=100, deadline=None)
def test_free_motions_of_all_regimes_of_damping(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    data = stated(rng, kind)
    system, s = system_of(data), arb(float(rng.uniform(-0.3, 12)), float(rng.choice([0, 1e-3, 0.2])))
    with ctx.workprec(int(rng.choice([53, 96]))):
        found = free_motion(system, s)
    one, time = equation(rng, data), within(rng, s)
    a, rate, area = free(one.b, one.k, time)
    for ball_of, value in zip(found, (a, rate, one.g * area), strict=True):
        assert ball_of.overlaps(exact(value))
    if s.is_exact() and kind != "saddle":
        assert all(x.rad() < 1 for x in found)  # of use, not only true


@given(st.sampled_from(KINDS), SEEDS)
@settings(max_examples=50, deadline=None)
def test_harmonic_motions(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    data = stated(rng, kind)
    p, q = harmonic_motion(system_of(data))
    one = equation(rng, data)
    d, e = one.k - one.frequency**2, one.b * one.frequency
    found = mp.lu_solve(mp.matrix([[d, e], [-e, d]]), mp.matrix([one.cosine, one.sine]))
    assert p.overlaps(exact(found[0]))
    assert q.overlaps(exact(found[1]))


@pytest.mark.parametrize(("damping", "stiffness"), [("0", "1"), ("0", "1.0000001"), ("2e-9", "1")])
def test_resonance_is_refused_where_the_balls_may_hold_it(damping: str, stiffness: str) -> None:
    data = stated(np.random.default_rng(1), "under") | {"damping": [damping, "0"], "stiffness": [stiffness, "1e-6"]}
    data["frequency"] = ["1", "0", 0]
    with pytest.raises(UnprovedError, match=message("verify.resonance")):
        next_impact(system_of(data), 0, arb(1), arb(1))
    with pytest.raises(UnprovedError, match=message("verify.resonance")):
        tables_of(system_of(data), 256, 8, 1, 1.0)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("force", ["nan", "0"], message("verify.not-finite")),
        ("stiffness", ["1", "inf"], message("verify.not-finite")),
        ("frequency", ["1", "0", 2], message("verify.not-finite")),
        ("frequency", ["0", "1e-9", 0], message("verify.system")),
        ("damping", ["0", "1e-9"], message("verify.system")),
        ("restitution", ["1", "1e-9"], message("verify.system")),
        ("walls", [{"at": ["inf", "0"], "side": 1}], message("verify.not-finite")),
        ("walls", [{"at": ["1", "0"], "side": 2}], message("verify.system")),
        ("walls", [{"at": ["1", "0"], "side": 1}, {"at": ["0", "0"], "side": 1}], message("verify.system")),
        ("walls", [{"at": ["-1", "0"], "side": 1}, {"at": ["1", "0"], "side": -1}], message("verify.walls")),  # crossed
        ("walls", [{"at": ["0", "1e-9"], "side": 1}, {"at": ["0", "0"], "side": -1}], message("verify.walls")),
    ],
)
def test_systems_that_make_no_sense_are_refused(name: str, value: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        system_of(stated(np.random.default_rng(1), "under") | {name: value})


@given(st.sampled_from(KINDS), SEEDS)
@settings(max_examples=6, deadline=None)
def test_tables_and_bounds(kind: str, seed: int) -> None:
    """Tables are within their bound of error of the flights of all systems; derivatives are below their bounds."""
    rng = np.random.default_rng(seed)
    data = stated(rng, kind)
    system, n, before, speed = system_of(data), 32, 4, 1.5
    tables = tables_of(system, n, before, 1, speed)
    for _ in range(4):
        one = equation(rng, data)
        w, step = one.frequency, 2 * mp.pi / one.frequency / n
        i, m = int(rng.integers(n)), int(rng.integers(-before, n))
        force = mp.mpc(one.cosine, -one.sine) / mp.mpc(one.k - w * w, one.b * w) * mp.expj(2 * mp.pi * i / n)
        push = one.g + one.cosine * mp.cos(2 * mp.pi * i / n) + one.sine * mp.sin(2 * mp.pi * i / n)
        a, rate, area = free(one.b, one.k, step * m)
        pairs = [*zip(tables.phases[i], (mp.re(force), mp.re(1j * w * force), push), strict=True)]
        pairs += zip(tables.flights[m + before], (a, rate, one.g * area), strict=True)
        pairs += zip(tables.numbers, (one.b, one.k, one.g, one.r), strict=True)
        assert all(abs(y - x) <= tables.eps * max(1, abs(y)) for y, x in pairs)
        error = max(abs(y - x) for y, (x, _) in zip(tables.places, one.walls, strict=True))
        assert error <= (tables.gap if system.k == 0 else tables.eps * max(1, np.abs(tables.places).max()))
        s, phase = step * m, mp.mpf(float(rng.uniform(0, 6.3)))
        depart, wall = mp.mpf(float(rng.uniform(-1, 1))) * speed, int(rng.integers(len(one.walls)))
        bend = -one.b * rate - one.k * a
        velocity = lambda x, y, one=one, phase=phase, depart=depart, wall=wall, w=w, s=s: flight(  # noqa: E731
            one, wall, phase + w * x, depart, s + y - x
        )[1]
        third = [mp.diff(velocity, (0, 0), order, h=mp.mpf(10) ** -12) for order in ((2, 0), (1, 1), (0, 2))]
        force_rate = w * (one.sine * mp.cos(phase) - one.cosine * mp.sin(phase))
        assert all(abs(x) <= y for x, y in zip((rate, bend, *third, force_rate), tables.bounds, strict=True))


@given(st.sampled_from(KINDS), SEEDS)
@settings(max_examples=24, deadline=None)
def test_next_impacts_of_boxes(kind: str, seed: int) -> None:
    """Of a box of states and a ball of systems: the wall, the impact, and slopes between two states, or two walls, of the box."""
    rng = np.random.default_rng(seed)
    data = stated(rng, kind)
    system, wall = system_of(data), int(rng.integers(len(data["walls"])))
    phase, speed = (arb(float(rng.uniform(*ends)), float(rng.choice([0, 1e-6, 3e-3]))) for ends in ((0, 6.3), (0.3, 2.5)))
    try:
        impact = next_impact(system, wall, phase, speed)
    except UnprovedError:
        return
    one, start = equation(rng, data), (within(rng, phase), within(rng, speed))
    first = seen(one, wall, *start)
    if first is None:  # a long flight
        assert impact.phase - phase > 6 * math.pi - 1e-6
        return
    assert first[0] == impact.wall
    met = landed(one, wall, *start, *first)
    assert impact.phase.overlaps(exact(met[0]))
    assert impact.speed.overlaps(exact(met[1]))
    column, ways = int(rng.integers(4)), [mp.mpf(0)] * 4
    other = (within(rng, phase), within(rng, speed))
    if column < 2:
        ways[column] = other[column] - start[column]
        again = landed(one, wall, start[0] + ways[0], start[1] + ways[1], *first)
    else:
        moved = wall if column == 2 else impact.wall
        ends, (at, side) = data["walls"][moved]["at"], one.walls[moved]
        ways[column] = point(rng, ends) - at
        walls = tuple((at + ways[column], side) if i == moved else each for i, each in enumerate(one.walls))
        again = landed(one._replace(walls=walls), wall, *start, *first)
    if ways[column] and (column < 2 or wall != impact.wall):
        for row in (0, 1):
            slope = (again[row] - met[row]) / ways[column]
            assert (*impact.derivative[row], *impact.by_walls[row])[column].overlaps(exact(slope))


@given(st.sampled_from(KINDS), SEEDS)
@settings(max_examples=15, deadline=None)
def test_next_impacts_of_parallelograms(kind: str, seed: int) -> None:
    """Two impacts of a state of a parallelogram are those of its middle and what the derivative adds, wherever walls are."""
    rng = np.random.default_rng(seed)
    data = stated(rng, kind)
    system, wall = system_of(data), int(rng.integers(len(data["walls"])))
    middle = arb(float(rng.uniform(0, 6.3))), arb(float(rng.uniform(0.5, 2.5)))
    matrix = tuple(tuple(arb(float(x)) for x in row) for row in rng.normal(size=(2, 2)))
    ways = tuple(arb(0, float(x)) for x in rng.choice([1e-7, 1e-4], 2))
    try:
        walls, end, slope = next_impacts(system, wall, middle, matrix, ways, 2)  # type: ignore[arg-type]
    except UnprovedError:
        return
    one, way = equation(rng, data), [within(rng, x) for x in ways]
    state = [
        mp.mpf(float(x.mid())) + sum(mp.mpf(float(y.mid())) * z for y, z in zip(row, way, strict=True))
        for x, row in zip(middle, matrix, strict=True)
    ]
    for expected in walls:
        first = seen(one, wall, *state)
        if first is None:  # a long flight
            return
        assert first[0] == expected
        state, wall = list(landed(one, wall, *state, *first)), expected
    for row in (0, 1):
        assert (end[row] + sum(x * exact(y) for x, y in zip(slope[row], way, strict=True))).overlaps(exact(state[row]))


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_matrices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    left, right = rng.normal(size=(2, 2, 2))
    balls = tuple(tuple(arb(float(x), 1e-3) for x in row) for row in right)
    some = mp.matrix(right.tolist()) + mp.matrix(rng.uniform(-1e-3, 1e-3, (2, 2)).tolist())
    product, inverse = mp.matrix(left.tolist()) * some, mp.matrix(left.tolist()) ** -1
    found = times(tuple(tuple(map(arb, row)) for row in left.tolist()), balls)  # type: ignore[arg-type]
    back = inverse_of(tuple(map(tuple, left.tolist())))  # type: ignore[arg-type]
    for i in (0, 1):
        for j in (0, 1):
            assert found[i][j].overlaps(exact(product[i, j]))
            assert back[i][j].overlaps(exact(inverse[i, j]))
    with pytest.raises(UnprovedError, match=message("verify.not-regular")):
        inverse_of(((1.0, 0.5), (2.0, 1.0)))


@given(st.floats(-1e6, 1e6), st.sampled_from(WIDE), st.floats(-1, 1))
@settings(max_examples=50, deadline=None)
def test_balls_of_decimals(value: float, radius: float, share: float) -> None:
    assert ball([repr(value), repr(radius)]).overlaps(exact(mp.mpf(repr(value)) + mp.mpf(repr(radius)) * share))


@given(SEEDS)
@settings(max_examples=4, deadline=None)
def test_images_of_a_trap(seed: int) -> None:
    """States of a part of the kept trap after some impacts, in its own coordinates."""
    rng, kept = np.random.default_rng(seed), read(KEPT / "fp-coarse.proof")
    data = {**kept.system}
    system, trap = system_of(data), trap_of(kept.trap)._replace(impacts=2)
    part = tuple(arb(float(rng.uniform(-0.9, 0.9)) * half, float(rng.choice([0, 0.02])) * half) for half in trap.half)
    walls, end, derivative = carried(system, trap, part)  # type: ignore[arg-type]
    one, matrix, ends = equation(rng, data), mp.matrix(trap.matrix), []
    for place in ([mp.mpf(float(x.mid())) for x in part], [within(rng, x) for x in part]):
        state, wall = matrix * mp.matrix(place), trap.wall
        state = [state[i] + mp.mpf(trap.centre[i]) for i in (0, 1)]
        for expected in walls:
            first = seen(one, wall, *state)
            assert first is not None
            assert first[0] == expected
            state, wall = list(landed(one, wall, *state, *first)), expected
        ends.append((place, state))
    assert all(x.overlaps(exact(y)) for x, y in zip(end, ends[0][1], strict=True))
    moved = matrix**-1 * mp.matrix([y - x for x, y in zip(ends[0][1], ends[1][1], strict=True)])
    way = [exact(y - x) for x, y in zip(ends[0][0], ends[1][0], strict=True)]
    for i in (0, 1):
        assert (derivative[i][0] * way[0] + derivative[i][1] * way[1]).overlaps(exact(moved[i]))


def test_a_contraction_holds_the_stretching_of_pairs_of_states() -> None:
    """The oscillator with critical damping: a coarse trap around the cycle of one impact a period, against pairs of orbits."""
    w, wall, r, amplitude = (mp.mpf(x) for x in ("1.5", "0.15", "0.3", "1"))
    one = Equation(mp.mpf(2), mp.mpf(1), mp.mpf(0), amplitude, mp.mpf(0), w, ((wall, 1),), r)
    state: Any = (mp.mpf("1.035"), mp.mpf("0.396"))
    for _ in range(6):
        first = seen(one, 0, *state)
        assert first is not None
        state = landed(one, 0, *state, *first)
    names = ("damping", "stiffness", "force", "cosine", "sine", "restitution")
    data = {name: [str(x), "0"] for name, x in zip(names, ("2", "1", "0", "1", "0", "0.3"), strict=True)}
    data |= {"frequency": ["1.5", "0", 0], "walls": [{"at": ["0.15", "0"], "side": 1}]}  # type: ignore[dict-item]
    centre = [float(state[0] % (2 * mp.pi)), float(state[1])]
    trap = trap_of(
        {"wall": 0, "centre": centre, "matrix": [[1.0, 0.0], [0.0, 1.0]], "half": [1e-3, 1e-3], "impacts": 2, "pieces": [1, 1]}
    )
    factor, rng = contraction(system_of(data), trap), np.random.default_rng(3)
    assert factor < 1
    for _ in range(3):
        ends = []
        starts = [[mp.mpf(x) + mp.mpf(1e-3) * mp.mpf(float(rng.uniform(-1, 1))) for x in centre] for _ in (0, 1)]
        for place in starts:
            for _ in range(2):
                first = seen(one, 0, *place)
                assert first is not None
                place = list(landed(one, 0, *place, *first))
            ends.append(place)
        size = lambda x, y: max(abs(a - b) for a, b in zip(x, y, strict=True))  # noqa: E731
        assert size(*ends) <= factor * size(*starts)


@given(st.floats(0.15, 0.8), st.floats(1.02, 1.3), SEEDS)
@settings(max_examples=15, deadline=None)
def test_boxes_around_cycles_keep_them(r: float, share: float, seed: int) -> None:
    """One impact a period of a bouncing ball, by its closed form: Krawczyk's box of any box that holds it holds it."""
    rng = np.random.default_rng(seed)
    with mp.workdps(60):
        cosine = 1 / mp.mpf(share)
        gamma = mp.pi * (1 - mp.mpf(r)) / (cosine * (1 + mp.mpf(r)))
        phase, speed = mp.acos(cosine), 2 * mp.pi / (1 + mp.mpf(r))
    system = System(arb(0), arb(0), arb(-1), arb(0), exact(gamma), arb(1), ((arb(0), -1),), arb(r))
    with ctx.workprec(96):
        radius = 10.0 ** float(rng.uniform(-9, -3))
        middle = [exact(x + mp.mpf(radius) * mp.mpf(float(rng.uniform(-0.9, 0.9)))).mid() for x in (phase, speed)]
        box = [arb(x) + arb(0, radius) for x in middle]
        step = krawczyk(system, [0], [arb(x) for x in middle], box)
    assert step.turns == (1, 0)
    assert all(x.overlaps(exact(y)) for x, y in zip(step.box, (phase, speed), strict=True))
    statement = {"walls": [0], "states": [[float(phase), float(speed)]], "radii": [[1e-7, 1e-7]]}
    cycle = verified(system, cycle_of(statement, 1))
    trace = 1 + mp.mpf(r) ** 2 - (1 + mp.mpf(r)) ** 2 * gamma * mp.sin(phase)
    pairs = zip((*cycle.states[0], cycle.trace, cycle.determinant), (phase, speed, trace, mp.mpf(r) ** 2), strict=True)
    assert all(x.overlaps(exact(y)) for x, y in pairs)


def test_states_of_a_set_that_covers_another_lie_across_it() -> None:
    """Of a kept horseshoe, by states of a set and of its edges in 60 digits."""
    kept = read(KEPT / "transient.proof")
    data, rng = {**kept.system}, np.random.default_rng(5)
    system, stated_sets = system_of(data), horseshoe_of(kept.horseshoe, 2)
    short = [pair for pair in stated_sets.relations if len(stated_sets.sets[pair[0]].walls) == 1]
    for i, j in [short[0], short[-1]]:
        source, target = stated_sets.sets[i], stated_sets.sets[j]
        assert covers(system, stated_sets.wall, source, [target]) > 0
        one, inverse, sides = equation(rng, data), mp.matrix(target.matrix) ** -1, []
        for x in (-1.0, 1.0, *rng.uniform(-1, 1, 6)):
            place = mp.matrix(source.matrix) * mp.matrix([x, float(rng.uniform(-1, 1))])
            state, wall = [mp.mpf(source.centre[k]) + place[k] for k in (0, 1)], stated_sets.wall
            for expected in source.walls:
                first = seen(one, wall, *state)
                assert first is not None
                assert first[0] == expected
                state, wall = list(landed(one, wall, *state, *first)), expected
            gap = state[0] - mp.mpf(target.centre[0])
            gap -= 2 * mp.pi * mp.nint(gap / (2 * mp.pi))
            along, across = inverse * mp.matrix([gap, state[1] - mp.mpf(target.centre[1])])
            assert abs(across) < 1 or abs(along) > 1
            sides.append(along)
        assert sides[0] * sides[1] < 0
        assert min(abs(sides[0]), abs(sides[1])) > 1


@given(SEEDS)
@settings(max_examples=6, deadline=None)
def test_entropies_are_below_spectral_radii(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 9))
    matrix = (rng.random((size, size)) < 0.5) | np.eye(size, dtype=bool)
    relations = [(int(i), int(j)) for i, j in np.argwhere(matrix)]
    radius = abs(np.linalg.eigvals(matrix.astype(float))).max()
    try:
        found = entropy(size, relations)
    except UnprovedError:
        return
    assert found <= np.log(radius) + 1e-12
