"""Flights whose terms cancel, against 40 digits: right, or undecided; never certified and wrong."""

from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from nsmaps_impact_oscillator import ImpactOscillator
from toys import Table

from nsmaps.exact.impacts import TWO_PI, Outcome
from nsmaps.exact.remainders import growth, twin
from nsmaps.exact.system import ImpactSystem, Wall


class Textbook(ImpactSystem):
    """x'' + 2 zeta x' + x = A cos(w t) above a wall, by hyperbolic functions, by circular ones or by two exponentials."""

    zeta: float
    w: float = 1.0
    A: float = 4.0
    wall: float = 0.1
    r: float = 0.8
    by: str = "cosh"

    def walls(self):
        return {"B": Wall(at=self.wall, side=-1)}

    def period(self):
        return 2 * sp.pi / self.w

    def steady(self, t):
        spring, damper = 1 - self.w**2, 2 * self.zeta * self.w
        return self.A * (spring * sp.cos(self.w * t) + damper * sp.sin(self.w * t)) / (spring**2 + damper**2)

    def displacement(self, t, hit):
        s, x, zeta = t - hit.t, sp.Dummy(), self.zeta
        z, w = hit.z - self.steady(hit.t), hit.w - self.steady(x).diff(x).subs(x, hit.t)
        if self.by == "cos":
            k = sp.sqrt(1 - zeta**2)
            return self.steady(t) + sp.exp(-zeta * s) * (z * sp.cos(k * s) + (w + zeta * z) / k * sp.sin(k * s))
        k = sp.sqrt(zeta**2 - 1)
        if self.by == "cosh":
            return self.steady(t) + sp.exp(-zeta * s) * (z * sp.cosh(k * s) + (w + zeta * z) / k * sp.sinh(k * s))
        slow, fast = -zeta + k, -zeta - k
        return self.steady(t) + ((w - fast * z) * sp.exp(slow * s) - (w - slow * z) * sp.exp(fast * s)) / (2 * k)


class Dragged(ImpactSystem):
    """x'' = -1 - c x' + a sin t above a floor."""

    c: float
    a: float
    r: float = 0.8

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        return 2 * sp.pi

    def displacement(self, t, hit):
        def carried(t):
            return -t / self.c - self.a * (sp.sin(t) + self.c * sp.cos(t)) / (1 + self.c**2)

        x = sp.Dummy()
        w = hit.w - carried(x).diff(x).subs(x, hit.t)
        return hit.z + carried(t) - carried(hit.t) + w * (1 - sp.exp(-self.c * (t - hit.t))) / self.c


class Saddle(ImpactSystem):
    """x'' = k^2 (x - tilt) + sin(4 t), between walls at 0 and 1: what grows and what decays of a flight may cancel."""

    k: float
    tilt: float = 0.5
    r: float = 0.7
    horizon = 2.0

    def walls(self):
        return {"F": Wall(at=0, side=-1), "C": Wall(at=1, side=1)}

    def period(self):
        return sp.pi / 2

    def displacement(self, t, hit):
        def steady(t):
            return self.tilt - sp.sin(4 * t) / (16 + self.k**2)

        s, x = t - hit.t, sp.Dummy()
        z, w = hit.z - steady(hit.t), hit.w - steady(x).diff(x).subs(x, hit.t)
        return steady(t) + z * sp.cosh(self.k * s) + w / self.k * sp.sinh(self.k * s)


def formulas(system):
    """The displacement that the class says, and its rate, of (t, t0, z0, w0) in mpmath: independent of the kernel."""
    t, t0, z0, w0 = sp.symbols("t t0 z0 w0", real=True)
    symbols = {name: sp.Symbol(f"p_{name}", real=True) for name in system.parameter_names()}
    fixed = {name: getattr(system, name) for name in type(system).model_fields if name not in symbols}
    expr = type(system).model_construct(**symbols, **fixed).displacement(t, SimpleNamespace(t=t0, z=z0, w=w0))
    values = [mp.mpf(value) for value in system.parameters.values()]
    place, velocity = (sp.lambdify((t, t0, z0, w0, *symbols.values()), f, "mpmath") for f in (expr, sp.diff(expr, t)))
    return (lambda *args: place(*args, *values)), (lambda *args: velocity(*args, *values))


def errors(system, states, returns):
    """The errors of speed and phase of returns of one flight, shape (N, 2); infinite where that flight had passed the wall."""
    place, velocity = formulas(system)
    wall, rate = next(iter(system.walls().values())), mp.mpf(system.phase_rate())
    found = np.full((len(states), 2), np.nan)
    for i in np.flatnonzero(np.isfinite(returns.image[:, 0]) & (returns.words == "BB")):
        start = mp.mpf(float(states[i, 1])) / rate, mp.mpf(wall.at), -wall.side * mp.mpf(system.r) * mp.mpf(float(states[i, 0]))

        def gap(s, start=start):
            return wall.side * (start[1] - place(start[0] + s, *start))

        s = mp.findroot(gap, mp.mpf(float(returns.time[i])), tol=mp.mpf(10) ** -60, maxsteps=200)
        if any(gap(s * mp.mpf(float(x))) < 0 for x in np.linspace(0.003, 0.997, 80)):
            found[i] = np.inf
            continue
        v, phi = abs(velocity(start[0] + s, *start)), mp.mpf(float(states[i, 1])) + rate * s
        off = phi - mp.mpf(float(returns.image[i, 1])) - 2 * mp.pi * int(returns.turns[i, 1])
        found[i] = float(abs(v - mp.mpf(float(returns.image[i, 0])))), float(abs(off))
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
    with mp.workdps(40):
        assert errors(system, states, returns).max() < 1e-12


@pytest.mark.parametrize("zeta", [1 + 1e-14, 1 + 1e-12, 1 + 1e-5, 1 + 1e-3])
def test_what_cancels_in_the_formula_itself_is_not_certified(zeta):
    """Two exponentials over 2 k, k next to zero, cannot be merged: their coefficients cancel."""
    system, states = Textbook(zeta=zeta, by="exp"), random_states(3.0)
    returns = system.first_return(states)
    with mp.workdps(40):
        off = errors(system, states, returns).max(axis=1)
    assert (returns.certified == (zeta > 1 + 1e-7)).all()
    assert (off[returns.certified] < 1e-10).all()
    assert off.max() > (1e-10 if zeta < 1 + 1e-11 else 1e-14)


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
    assert lost > 2


def test_remainders_of_two_rates():
    """exp(a s) sinh(k s) and that less k s, for k of all sizes and both signs."""
    rng = np.random.default_rng(3)
    with mp.workdps(60):
        for _ in range(2000):
            a = -(10 ** rng.uniform(-8, 2.5))
            k = rng.choice([-1, 1]) * 10 ** rng.uniform(-14, 2.5)
            x = a + k
            exact_a = mp.mpf(x) - mp.mpf(k)
            n, r = twin(k, x, growth(x)[0])
            exact = mp.exp(exact_a) * mp.sinh(mp.mpf(k))
            size = abs(exact) + abs(mp.mpf(k)) * (1 + mp.exp(mp.mpf(max(x, x - 2 * k))))
            assert abs(mp.mpf(float(n)) - exact) < 1e-15 * size
            assert abs(mp.mpf(float(r)) - (exact - mp.mpf(k))) < 1e-15 * size


def test_derivatives_of_the_textbook_form():
    """By the state and by zeta, against differences in 40 digits."""
    system, states = Textbook(zeta=3.0), random_states(3.0, 12, seed=9)
    returns = system.first_return(states, derivative=True)
    by_zeta = system._kernel().sensitivities(system, states, np.array([1.0, 0.0, 0.0, 0.0, 0.0]), 0.0)
    step = mp.mpf(10) ** -15

    def image(zeta, v, phi, time):
        place, velocity = symbolic
        start = phi, mp.mpf(system.wall), mp.mpf(system.r) * v
        s = mp.findroot(lambda s: place(zeta, phi + s, *start) - mp.mpf(system.wall), mp.mpf(float(time)))
        return abs(velocity(zeta, phi + s, *start)), phi + s

    zeta, t, t0, z0, w0 = sp.symbols("zeta t t0 z0 w0", real=True)
    expr = Textbook.model_construct(**{**system.parameters, "zeta": zeta}).displacement(t, SimpleNamespace(t=t0, z=z0, w=w0))
    symbolic = [sp.lambdify((zeta, t, t0, z0, w0), f, "mpmath") for f in (expr, sp.diff(expr, t))]
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


@pytest.mark.usefixtures("interpreted")
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
