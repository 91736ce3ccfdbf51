"""The exact first return of systems with modes as a program: C compiled and run, Julia as Python, against `first_return`."""

import math
import shutil

import as_python
import numpy as np
import pytest
import sympy as sp
from hybrid import BeforeWall, Friction
from messages import message
from run_c import Program, compare_node

import nsmaps
from nsmaps import Guard, PoincareSection
from nsmaps.errors import NsmapsError
from nsmaps.exact.modes.blocks.batch_scheduler import FEW

PAIR = {"eta": 0.1, "kappa": 0.04, "Lambda": 0.2, "d": 0.35, "r": 0.5, "g_bar": 0.2113}
gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not here, so the C was not run")
thorough = pytest.mark.thorough


class Ball(nsmaps.HybridSystem):
    """Ball on a moving table, after whose impacts the speed is no affine function."""

    A: float = 0.6
    r: float = 0.8

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -1}}

    def guards(self, t, y):
        u = y.v - self.A * sp.cos(t)
        after = self.A * sp.cos(t) + self.r * sp.Max(-u, 0) * (1 + u**2) ** sp.Rational(-1, 5)
        return {"B": Guard("flight", y.x - self.A * sp.sin(t), reset={"v": after})}

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


def slow(rows, n=5):
    """The same with a share of slow starts."""
    rows[:: len(rows) // n, 0] *= 1e-6
    return rows


def drawn(*bounds):
    """How many states within bounds, a share of them slow."""
    return lambda n: slow(np.random.default_rng(7).uniform(*np.transpose(bounds), (n, len(bounds))))


PHASE = (-7, 7)
SYSTEMS = {
    "belt": (lambda: nsmaps.load_system("belt", zeta=0.02, vb=0.3, mu_k=0.4, mu_s=0.6, w=0.9, A=0.25), drawn((-1, 1), PHASE)),
    "contact": (lambda: nsmaps.load_system("recoil_pair", **PAIR, contact=True), drawn((0, 1.5), (-1, 1), (-1, 1), PHASE)),
    "curved": (Ball, drawn((-2, 0), PHASE)),
    "converter": (lambda: nsmaps.load_system("buck_converter", E=24.5), drawn((10.5, 13), (0.2, 0.9))),
    "block": (lambda: nsmaps.load_system("rocking_block", a=3.3, w=4.0), drawn((0, 1.2), PHASE)),
    "friction": (lambda: Friction(mu=0.5), drawn((-1, 1), PHASE)),
    "masses": (lambda: nsmaps.load_system("two_masses", w=1.1, d=0.3), drawn((0, 1.5), (-1, 1), (-1, 1), PHASE)),
    "pair": (lambda: nsmaps.load_system("recoil_pair", **PAIR), drawn((0, 1.5), (-1, 1), (-1, 1), PHASE)),
    "soft": (lambda: nsmaps.load_system("soft_impact", xi=0.02, e=0.5, a=0.6, beta=20.0, w=0.9), drawn((0, 1.5), PHASE)),
}
OFTEN, N = ("belt", "contact", "curved"), 1000
SMALL = {"curved": 4e-15}  #: difference of derivatives that the order of sums in a formula may leave


def states_of(name, n):
    """Starts, some of them beside the section or no states."""
    system, draw = SYSTEMS[name][0](), SYSTEMS[name][1]
    rows = draw(n)
    if name in ("belt", "friction"):
        rows[n // 10 :] = system.on_section(rows[n // 10 :])
    rows[-1] = np.nan
    return system, rows


def one_by_one(system, states):
    """First returns with derivatives, of fewer states at a time than are computed in parallel, which programs do not."""
    parts = [system.first_return(states[k : k + FEW - 1], derivative=True) for k in range(0, len(states), FEW - 1)]
    return type(parts[0]).concatenate(parts)


@gcc
@pytest.mark.skipif(not shutil.which("node"), reason="node is not here, so the JavaScript was not run")
def test_javascript(tmp_path):
    """A motion of waves and square roots, whose program calls no function whose last digit is the library's."""
    system, states = states_of("belt", 1000)
    np.testing.assert_allclose(*compare_node(system, states, tmp_path), rtol=1e-12)


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in OFTEN else thorough) for name in SYSTEMS])
def test_c_is_the_compiled_map(name, tmp_path):
    """Every outcome, word, image, time and derivative, to the last two bits."""
    system, states = states_of(name, N if name in OFTEN else 100_000)
    program, own = Program(system, tmp_path, level="-O1"), one_by_one(system, states)
    images, outcomes, codes = program.batch(states)
    assert outcomes.tolist() == own.outcome.tolist()
    assert codes.tolist() == own.codes.tolist()
    np.testing.assert_allclose(images, own.image, rtol=4e-16, atol=0)
    assert {program.outcome(each) for each in set(outcomes)} >= {"returned", "invalid"}
    words = dict(zip(codes.tolist(), own.words, strict=True))
    assert {code: program.word(code) for code in words} == words
    for k in range(0, len(states), len(states) // 300):
        got = program.of(states[k])
        assert [got.outcome, got.code] == [own.outcome[k], own.codes[k]]
        assert got.turns in own.turns[k]
        np.testing.assert_allclose([*got.image, got.time], [*own.image[k], own.time[k]], rtol=4e-16)
        np.testing.assert_allclose(got.derivative, own.derivative[k].ravel(), rtol=4e-16, atol=SMALL.get(name, 0))
        assert np.isnan(program.of(states[k], derivative=False).derivative).all()


@pytest.mark.parametrize("name", OFTEN)
def test_julia_as_python(name):
    """The text of the module by rules of its own, not by those that wrote it."""
    system, states = states_of(name, 20)
    names = as_python.run(nsmaps.export(system, "julia", name="exact"))
    own, m = one_by_one(system, states), len(system.coordinates)
    entry = names.get("first_return_from_section") or names["return_of_row"]
    for k, state in enumerate(states.tolist()):
        image, slopes = as_python.Entries([math.nan] * m), as_python.Entries([math.nan] * m**2, m, m)
        outcome, code, _, _ = entry(as_python.Entries(state), image, slopes, names["memory"](m, 1e-12))
        assert [outcome, code] == [own.outcome[k], own.codes[k]]
        np.testing.assert_allclose(image.numbers, own.image[k], rtol=4e-16)
        np.testing.assert_allclose(slopes.numbers, own.derivative[k].ravel(), rtol=4e-16, atol=SMALL.get(name, 0))


def test_what_a_system_does_not_need_is_left_out():
    """Without contact, sliding, conditions and curved resets there is no code for them."""
    plain, contact = (nsmaps.export(SYSTEMS[name][0](), "c")["recoilpair.c"] for name in ("pair", "contact"))
    for part in ("mark_of", "repelled(", "call_reset(", "allowed("):
        assert f" {part}" not in plain
    assert " mark_of(" in contact


class Nonlinear(BeforeWall):
    """A pendulum before a wall."""

    def modes(self, t, y):
        return {"free": {"x": y.v, "v": self.A * sp.cos(self.w * t) - sp.sin(y.x)}}

    def guards(self, t, y):
        return {"B": Guard("free", y.x - self.wall, reset={"v": -self.r * y.v})}


def test_what_cannot_be_written_is_refused_by_name():
    values = {"zeta": 0.1, "w": 1.0, "A": 0.5, "wall": -0.2, "r": 0.8}
    with pytest.raises(NsmapsError, match=message("exports.nonlinear", system="Nonlinear", language="c")):
        nsmaps.export(Nonlinear(**values), "c")
    with pytest.raises(NsmapsError, match=message("exports.name-twice", name="memory")):
        nsmaps.export(SYSTEMS["soft"][0](), "julia", name="memory")
    assert nsmaps.export(SYSTEMS["soft"][0](), "julia", name="begins").count("function begins(") == 1
