"""Flights whose terms cancel, against 40 digits: right, or undecided; never certified and wrong."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from digits import in_balls, number
from flint import acb, arb, ctx
from nsmaps_impact_oscillator import ImpactOscillator
from systems import Dragged, Saddle, Table, Textbook

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.flight import layout
from nsmaps.exact.flows import tables
from nsmaps.exact.flows.balls import DIGITS, Number, Recorded
from nsmaps.exact.flows.exponentials import Decomposition
from nsmaps.exact.flows.formulas import PHI, S, W, Z
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems import flow as systems

IN_MPMATH = partial(sp.lambdify, modules="mpmath", cse=True)


def formulas(system, made=IN_MPMATH, number=mp.mpf):
    """The displacement that the class says, and its rate, of (t, t0, z0, w0) in many digits: independent of the kernel."""
    fixed = tuple((name, getattr(system, name)) for name in type(system).model_fields if name not in system.parameter_names())
    place, velocity = written(type(system), fixed, made)
    values = [number(value) for value in system.parameters.values()]
    return (lambda *args: place(*args, *values)), (lambda *args: velocity(*args, *values))


@cache
def written(cls, fixed, made):
    """Displacement and rate of a class with these fields, of (t, t0, z0, w0) and the parameters."""
    t, t0, z0, w0 = sp.symbols("t t0 z0 w0", real=True)
    symbols = {name: sp.Symbol(f"p_{name}", real=True) for name in cls.parameter_names()}
    expr = cls.model_construct(**symbols, **dict(fixed)).displacement(t, SimpleNamespace(t=t0, z=z0, w=w0))
    return [made((t, t0, z0, w0, *symbols.values()), f) for f in (expr, sp.diff(expr, t))]


def errors(system, states, returns):
    """The errors of speed and phase of returns of one flight, shape (N, 2); infinite where that flight had passed the wall."""
    place, velocity = formulas(system, in_balls, number)
    wall, rate = next(iter(system.walls().values())), number(system.phase_rate())
    at, turn, shares = number(wall.at), 2 * arb.pi(), [number(x) for x in np.linspace(0.003, 0.997, 80)]
    found = np.full((len(states), 2), np.nan)
    for i in np.flatnonzero(np.isfinite(returns.image[:, 0]) & (returns.words == "BB")):
        start = number(states[i, 1]) / rate, at, -wall.side * number(system.r) * number(states[i, 0])
        s = number(returns.time[i])
        for _ in range(8):
            s = (s - (place(start[0] + s, *start) - at) / velocity(start[0] + s, *start)).mid()
        if not all(wall.side * (at - place(start[0] + s * share, *start)) > 0 for share in shares):
            found[i] = np.inf
            continue
        v, phi = abs(velocity(start[0] + s, *start)), number(states[i, 1]) + rate * s
        off = phi - number(returns.image[i, 1]) - turn * int(returns.turns[i, 1])
        found[i] = [float(abs(x).upper()) for x in (v - number(returns.image[i, 0]), off)]
    return found


def random_states(top, n=60, seed=0):
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(0.02, top, n), rng.uniform(0, TWO_PI, n)])


RIGHT = {
    "textbook, zeta 3": (Textbook(zeta=3.0), 3.0),
    "textbook, zeta 50": (Textbook(zeta=50.0, A=200.0), 3.0),
    "textbook, just over critical": (Textbook(zeta=1 + 1e-12), 3.0),
    "textbook, just under critical": (Textbook(zeta=1 - 1e-12, by="cos"), 3.0),
    "two exponentials": (Textbook(zeta=3.0, by="exp"), 3.0),
    "drag": (Dragged(c=30.0, a=60.0), 40.0),
    "oscillator, zeta 50": (ImpactOscillator(zeta=50, w=0.5, A=200, wall=1.0, damping="over"), 40.0),
    "oscillator, just over critical": (ImpactOscillator(zeta=1 + 1e-12, w=0.5, A=2, wall=0.1, damping="over"), 3.0),
}


@pytest.mark.parametrize("kind", RIGHT)
def test_returns_are_right_and_decided(kind):
    system, top = RIGHT[kind]
    states = random_states(top)
    returns = system.first_return(states)
    assert (returns.outcome == Outcome.returned).all()
    with ctx.workdps(60):
        assert errors(system, states, returns).max() < 1e-12


@pytest.mark.parametrize("by", ["exp", "cosh", "cos"])
@pytest.mark.parametrize("off", [1e-14, 1e-12, 1e-9, 1e-5, 1e-3, 0.03, 0.1])
def test_next_to_critical_damping_from_both_sides(off, by):
    """Coefficients that cancel in the formula, over 2 k with k next to 0, are computed in many digits, the rates as a pair."""
    system, states = Textbook(zeta=1 - off if by == "cos" else 1 + off, by=by), random_states(3.0)
    returns = system.first_return(states)
    assert returns.certified.all()
    with ctx.workdps(60):
        assert errors(system, states, returns).max() < 1e-13


@pytest.mark.parametrize(("zeta", "w"), [(0.0, 1 + 1e-12), (0.0, 1 - 1e-9), (1e-12, 1.0), (1e-9, 1 + 1e-9), (1e-3, 1.0)])
def test_next_to_resonance(zeta, w):
    """The steady motion and the free one are large and cancel."""
    system, states = Textbook(zeta=zeta, w=w, wall=-0.5, by="cos"), random_states(3.0)
    returns = system.first_return(states)
    assert returns.certified.all()
    with ctx.workdps(60):
        assert errors(system, states, returns).max() < 1e-12


def test_flights_that_linger_at_a_saddle_are_right_or_undecided():
    """Starts within rounding of the stable manifold leave the saddle late: what is left of the start is lost on the way."""
    system = Saddle(k=6.0)
    place, velocity = formulas(system)
    phi = 1.0
    with mp.workdps(40):
        t0 = mp.mpf(phi) / 4
        still, slow = (velocity(t0 + mp.mpf(2.8), t0, mp.mpf(0), mp.mpf(w)) for w in (0, 1))
        rise = still / (still - slow)
        tops = [(float(rise) * (1 + sign * 10.0**-n)) / system.r for n in range(2, 9) for sign in (1, -1)]
        returns = system.first_return([[v, phi] for v in tops])
        lost = 0
        for v, certified in zip(tops, returns.certified, strict=True):
            hits = system.impacts([v, phi], 2)
            if len(hits.time) < 2:  # still there at the horizon
                continue
            s, up = mp.mpf(float(hits.time[1])), hits.wall[1]
            start = t0, mp.mpf(0), mp.mpf(system.r) * mp.mpf(v)
            s = mp.findroot(lambda s, start=start, up=up: place(t0 + s, *start) - int(up), s)
            off = abs(abs(velocity(t0 + s, *start)) - mp.mpf(float(hits.speed[1])))
            lost += off > 1e-10
            assert not certified or off < 1e-10
    assert returns.certified.any()
    assert not lost or not returns.certified.all()


def test_derivatives_of_the_textbook_form():
    """By the state and by zeta, against differences in 40 digits."""
    system, states = Textbook(zeta=3.0), random_states(3.0, 12, seed=9)
    returns = system.first_return(states, derivative=True)
    by_zeta = system._kernel().sensitivities(states, np.array([1.0, 0.0, 0.0, 0.0, 0.0]), 0.0)
    step = mp.mpf(10) ** -15

    def image(zeta, v, phi, time):
        place, velocity = symbolic
        start = phi, mp.mpf(system.wall), mp.mpf(system.r) * v
        s = mp.findroot(lambda s: place(zeta, phi + s, *start) - mp.mpf(system.wall), mp.mpf(float(time)))
        return abs(velocity(zeta, phi + s, *start)), phi + s

    zeta, t, t0, z0, w0 = sp.symbols("zeta t t0 z0 w0", real=True)
    expr = Textbook.model_construct(**{**system.parameters, "zeta": zeta}).displacement(t, SimpleNamespace(t=t0, z=z0, w=w0))
    symbolic = [sp.lambdify((zeta, t, t0, z0, w0), f, "mpmath", cse=True) for f in (expr, sp.diff(expr, t))]
    with mp.workdps(40):
        for k, (v, phi) in enumerate(states):
            at = [mp.mpf(3), mp.mpf(float(v)), mp.mpf(float(phi))]
            slopes = np.empty((2, 3))
            for j in range(3):
                ends = [image(*(x + sign * step * (i == j) for i, x in enumerate(at)), returns.time[k]) for sign in (1, -1)]
                slopes[:, j] = [float((a - b) / (2 * step)) for a, b in zip(*ends, strict=True)]
            assert returns.derivative[k] == pytest.approx(slopes[:, 1:], rel=1e-9, abs=1e-11)
            assert by_zeta[k] == pytest.approx(slopes[:, 0], rel=1e-9, abs=1e-11)


def test_images_of_boxes_hold_the_returns_of_the_textbook_form():
    system = Textbook(zeta=3.0)
    corner = random_states(2.0, 20, seed=5) + np.array([0.3, 0.0])
    boxes = np.stack([corner, corner + 0.01], axis=2)
    found = system.image_boxes(boxes)
    assert found.bounded.mean() > 0.8
    rng = np.random.default_rng(1)
    for k in np.flatnonzero(found.bounded):
        states = boxes[k, :, 0] + 0.01 * rng.uniform(size=(200, 2))
        low, high = found.hulls()[k].T
        assert ((system.first_return(states).lifted >= low) & (system.first_return(states).lifted <= high)).all()


def test_products_of_exponentials_are_multiplied_before_anything_else():
    """exp(-3 s) cosh(k s)^2 and the like: the same flight in other words has the same bounds, and is accepted as well."""

    class Plain(Table):
        def displacement(self, t, hit):
            s = t - hit.t
            return hit.z + hit.w * (1 - sp.exp(-2 * s)) / 2 - (2 * s - 1 + sp.exp(-2 * s)) / 4

    class Written(Table):
        def displacement(self, t, hit):
            s = t - hit.t
            decay = sp.exp(-5 * s) * sp.exp(s) ** 3
            even = sp.exp(-2 * s) * (sp.cosh(3 * s) ** 2 - sp.sinh(3 * s) ** 2)
            return hit.z + hit.w * (1 - decay) / 2 - (2 * s - 1 + even) / 4

    states = random_states(3.0, 20)
    plain, written = (made(height=0.3).first_return(states) for made in (Plain, Written))
    assert plain.words.tolist() == written.words.tolist()
    assert plain.image == pytest.approx(written.image, rel=1e-13)


def test_sums_kept_from_other_parameters_are_those_of_a_new_formula():
    """As one parameter changes, then another, back again, and to where two rates agree."""
    a, k = sp.symbols("a k")
    formula = a * Z * sp.exp(-k * S) * sp.cos(S + PHI) + sp.exp(-S) * (sp.sin(k * S) - a * W) + k**2

    def terms(program):
        total = Decomposition(program).sum(formula)
        return [number for term, x in total.items() for number in (Number(program, term.rate), x)], list(total)

    used, counts = Recorded((a, k), terms), set()
    with ctx.workdps(DIGITS):
        s, phi, place, speed = (arb(x) / 10 for x in (7, 11, 5, 3))
        states = {"": 1, "z": place, "w": speed}
        for values in ([1.0, 0.5], [2.0, 0.5], [2.0, 0.7], [1.0, 0.5], [1.0, 1.0], [0.0, 1.0], [2.0, 0.5]):
            found, of = used.at(values)
            expected, again = Recorded((a, k), terms).at(values)
            assert of == again
            assert all(x.overlaps(y) for x, y in zip(found, expected, strict=True))
            total = sum(
                x * s**t.power * states[t.state] * (rate * s + acb(0, t.harmonic) * phi).exp()
                for rate, x, t in zip(found[::2], found[1::2], of, strict=True)
            )
            decay = values[0] * place * (-values[1] * s).exp() * (s + phi).cos()
            direct = decay + (-s).exp() * ((values[1] * s).sin() - values[0] * speed) + arb(values[1]) ** 2
            assert abs(total - direct) < 1e-45
            counts.add(len(of))
    assert len(counts) > 1


def test_tables_repeated_at_other_parameters_are_those_of_new_formulas():
    """Across slow waves, the ends of damping and rates that agree, and back."""
    system = ImpactOscillator(zeta=0.5, w=0.7, A=1.2, wall=0.1)
    used, width = tables.formulas_of(system), []
    for zeta in (0.5, 0.9999, 0.99999, 0.3, 0.0, 0.3, 0.9999, 0.0, 1e-9, 0.7):
        values = [zeta, 0.7, 1.2, 0.1, 0.9]
        tables._flight.cache_clear()
        found = used.table(values)
        assert np.array_equal(found, replace(used).table(values), equal_nan=True)
        width.append(len(found))
    assert len(set(width)) == 2  # waves that are slow have a chain


def test_tables_made_in_many_threads_are_the_same():
    """The precision of mpmath belongs to all threads: a table is made at a time."""
    zetas = [3 + k / 64 for k in range(64)]
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda zeta: Textbook(zeta=zeta)._kernel().table, zetas))
    systems._kernel.cache_clear()
    for zeta, table in zip(zetas, made, strict=True):
        again = Textbook(zeta=zeta)._kernel().table
        numbers = slice(layout.HEAD, None)
        assert np.array_equal(table[numbers], again[numbers])
