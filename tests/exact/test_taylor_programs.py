"""heyoka's programs of nonlinear modes against Taylor coefficients of closed forms, by address and through Python."""

import ctypes
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from messages import message

import nsmaps
from nsmaps.errors import NsmapsError, SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.systems.flow import _kernel
from nsmaps.exact.taylor import linking, programs
from nsmaps.exact.taylor.expressions import expression, heyoka
from nsmaps.exact.taylor.laws import EXP, ORIGIN, TANH, derived_law, flat_kinds, rate_law
from nsmaps.exact.taylor.linking import SIGNATURE, link_step, python_step, step_of
from nsmaps.exact.taylor.programs import ALONG, FLIGHT, Formulas, program_of, steps_of

pytest.importorskip("heyoka")

X = sp.Symbol("_y_x", real=True)
A, W = sp.symbols("_p_a _p_w", real=True)
TERMS = 21
START, RATE, TURN, PHASE = 0.3, 1.25, 0.75, 0.4
CLOSE = 1e-13  #: of coefficients, relative to the largest


@dataclass(eq=False)
class Tangent:
    """Formulas of a definition, by default x' = a (1 + x^2), so x = tan(a t + atan x), with atan(x) + sin(phi) derived."""

    variables: tuple = (X,)
    symbols: tuple = (A, W)
    phase_rate: sp.Expr = W
    smooth: tuple = ((A * (1 + X**2),),)
    derived: tuple = (sp.atan(X) + sp.sin(PHI),)
    states: tuple = ("x",)
    transitions: tuple = ()


def expand(address, states, par, rows):
    """What a step writes, shape (rows, TERMS)."""
    given = [np.array(values, float) for values in (states, par, [0.0], [0.0])]
    tc = np.full((rows, TERMS), np.nan)
    SIGNATURE(address)(*(array.ctypes.data for array in (*given, tc)))
    assert given[0].tolist() == list(states)
    return tc


def coefficients(function):
    with mp.workdps(30):
        return np.array([float(c) for c in mp.taylor(function, 0, TERMS - 1)])


def near(found, known):
    assert abs(found - known).max() <= CLOSE * abs(known).max()


def test_series_of_own_and_derived_states_are_those_of_the_motion():
    definition = Tangent()
    (address,) = steps_of(definition, FLIGHT)
    begin = [START, float(np.arctan(START) + np.sin(PHASE))]
    own, derived = expand(address, begin, [PHASE, RATE, TURN], 2)
    near(own, coefficients(lambda t: mp.tan(RATE * t + mp.atan(START))))
    near(derived, coefficients(lambda t: RATE * t + mp.atan(START) + mp.sin(PHASE + TURN * t)))


def test_series_of_derivatives_are_those_by_state_phase_and_direction():
    (address,) = steps_of(Tangent(), ALONG)
    own, by_state, by_phase, along = expand(address, [START, 1, 0, 0], [PHASE, RATE, TURN, 0.5, 2.0, 0.0], 4)
    near(own, coefficients(lambda t: mp.tan(RATE * t + mp.atan(START))))
    near(by_state, coefficients(lambda t: mp.sec(RATE * t + mp.atan(START)) ** 2 / (1 + START**2)))
    assert not by_phase.any()
    near(along, coefficients(lambda t: t / 2 * mp.sec(RATE * t + mp.atan(START)) ** 2))


def test_steps_of_equal_formulas_are_one_program():
    assert steps_of(Tangent(), FLIGHT) == steps_of(Tangent(), FLIGHT)


def test_a_step_that_cannot_be_linked_is_made_through_python(monkeypatch):
    made = Tangent()
    program = program_of(Formulas(made.smooth[0], made.derived, made.variables, made.symbols, W), FLIGHT)
    given = [START, 0.7], [PHASE, RATE, TURN], 2
    steps = link_step(program), python_step(program)
    machine, python = (expand(step.address, *given) for step in steps)
    assert np.array_equal(machine, python)

    def fail(*_):
        raise RuntimeError("another LLVM")

    monkeypatch.setattr("llvmlite.binding.create_mcjit_compiler", fail)
    other = step_of(program)
    assert isinstance(other.owner, ctypes._CFuncPtr)
    assert np.array_equal(expand(other.address, *given), machine)


def test_returns_through_python_are_those_of_linked_steps(monkeypatch):
    class Swing(nsmaps.HybridSystem):
        """A pendulum between two stops."""

        a: float = 0.5
        states = ("x", "v")

        def modes(self, t, y):
            return {"m": {"x": y.v, "v": -sp.sin(y.x)}}

        def guards(self, t, y):
            return {"R": nsmaps.Guard("m", self.a - y.x, reset={"v": -y.v}), "L": nsmaps.Guard("m", y.x + 1, reset={"v": -y.v})}

        def section(self, t, y):
            return nsmaps.PoincareSection("R", ("v",))

    starts = np.linspace(0.2, 3, 50)[:, None]
    machine = Swing(a=0.5).first_return(starts)
    monkeypatch.setattr(linking, "link_step", None)
    monkeypatch.setattr(programs, "_step", cache(programs._step.__wrapped__))
    _kernel.cache_clear()
    python = Swing(a=0.5).first_return(starts)
    _kernel.cache_clear()
    assert set(machine.words.tolist()) == {"RR", "RLR"}
    assert np.array_equal(machine.image, python.image)


@pytest.mark.parametrize("way", [link_step, python_step])
def test_threads_do_not_disturb_one_another(way):
    made = Tangent()
    step = way(program_of(Formulas(made.smooth[0], (), made.variables, made.symbols, W), FLIGHT))
    starts = np.linspace(-1, 1, 40)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda x: expand(step.address, [x], [PHASE, RATE, TURN], 1), starts.tolist()))
    assert len(found) == 40
    for x, tc in zip(starts, found, strict=True):
        assert tc[0, 0] == x
        assert tc[0, 1] == pytest.approx(RATE * (1 + x * x), rel=1e-15)


def written(address, size):
    """What a law writes at the start, shape (size,)."""
    out, states, values = np.full(size, np.nan), np.array([START]), np.array([RATE, TURN])
    kind = ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 3)
    kind(address)(PHASE, states.ctypes.data, values.ctypes.data, out.ctypes.data)
    return out


def test_derived_states_come_with_their_derivatives():
    expected = [np.arctan(START) + np.sin(PHASE), 1 / (1 + START**2), np.cos(PHASE), 0, 0, np.arctan(START) + np.sin(PHASE)]
    assert written(derived_law(Tangent()), 6).tolist() == pytest.approx(expected, rel=1e-15)


def test_rates_come_with_sizes_derivatives_and_functions_with_flat_parts():
    made = Tangent(smooth=((A * sp.tanh(3 * X) - sp.sqrt(1 + X**2) * sp.cos(PHI) + sp.exp(-X),),))
    ((address,), (kinds,)) = rate_law(made), flat_kinds(made)
    assert sorted(kinds) == sorted([TANH, ORIGIN, EXP])
    out = written(address, 4 + 3 * 3)
    root, fall = np.sqrt(1 + START**2), np.exp(-START)
    push, pull = RATE * np.tanh(3 * START), root * np.cos(PHASE)
    slope = 3 * RATE / np.cosh(3 * START) ** 2 - START / root * np.cos(PHASE) - fall
    assert out[:4].tolist() == pytest.approx([push - pull + fall, push + pull + fall, slope, root * np.sin(PHASE)], rel=1e-13)
    parts = {kind: out[4 + 3 * k : 7 + 3 * k].tolist() for k, kind in enumerate(kinds)}
    assert parts[TANH] == pytest.approx([3 * START, RATE, 0])
    assert parts[ORIGIN] == pytest.approx([1 + START**2, -np.cos(PHASE), 0])
    assert parts[EXP] == pytest.approx([-START, 1, 0])


def test_functions_without_series_are_refused_by_name():
    with pytest.raises(SystemDefinitionError, match=message("exact.no-program-series", name="besselj")):
        expression(sp.besselj(0, X), {X: heyoka().make_vars("x")})


def test_without_heyoka_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    with pytest.raises(NsmapsError, match=message("exact.no-heyoka")):
        expression(X, {})
