"""Formulas of sympy as text: read back they have the same values, and intervals hold these; what has no text is refused."""

import operator
from functools import reduce

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message

from nsmaps.enclosures.first_match import enclosure_of
from nsmaps.errors import ConditionError
from nsmaps.files.expressions import FUNCTIONS
from nsmaps.reduced.conditions.algebras import Numbers, Symbols
from nsmaps.reduced.conditions.condition import read_condition
from nsmaps.reduced.conditions.fold import fold_term
from nsmaps.reduced.conditions.text import text_of

NAMES = ("v", "phi")
V, PHI = sp.symbols("v phi", real=True)
ELEMENTARY = ["sin", "cos", "tan", "exp", "log", "sqrt", "asin", "acos", "atan", "sinh", "cosh", "tanh"]
MP = mpmath.mp.clone()
MP.dps = 40
RULES = {  # name -> in sympy, and in mpmath; a step is None beside its edge
    **{name: (getattr(sp, name), getattr(MP, name)) for name in ELEMENTARY},
    "abs": (sp.Abs, abs),
    "sign": (sp.sign, lambda x: None if abs(x) < 1e-9 else MP.sign(x)),
    "floor": (sp.floor, lambda x: None if beside(x) else MP.floor(x)),
    "ceiling": (sp.ceiling, lambda x: None if beside(x) else MP.ceil(x)),
    "heaviside": (sp.Heaviside, lambda x: None if abs(x) < 1e-9 else MP.mpf(x > 0)),
    "mod": (sp.Mod, lambda x, y: None if not y or beside(x / y) else x - y * MP.floor(x / y)),
    "min": (sp.Min, min),
    "max": (sp.Max, max),
    **{name: (getattr(operator, name),) * 2 for name in ("add", "sub", "mul", "truediv", "pow")},
}
ONE, TWO = [*ELEMENTARY, "abs", "sign", "floor", "ceiling", "heaviside"], ["add", "sub", "mul", "truediv", "min", "max", "mod"]
STATES = [(0.7, 2.9), (-1.3, 5.1), (0.25, 0.4)]


def beside(x):
    """Whether a number is next to a whole one."""
    return abs(x - MP.nint(x)) < 1e-9


leaves = st.one_of(
    st.sampled_from([V, PHI, sp.pi, sp.E, sp.Rational(1, 3), sp.Integer(-2), sp.Float(0.1)]),
    st.floats(0.01, 3, allow_subnormal=False).map(sp.Float),
)
trees = st.recursive(
    leaves,
    lambda part: st.one_of(
        st.tuples(st.sampled_from(ONE), part),
        st.tuples(st.sampled_from(TWO), part, part),
        st.tuples(st.just("pow"), part, st.sampled_from([2, 3, -1, -2, 0.5, -0.5, 1.5]).map(sp.nsimplify)),
    ),
    max_leaves=6,
)


def symbolic(tree):
    """A tree as a formula of sympy."""
    return RULES[tree[0]][0](*map(symbolic, tree[1:])) if isinstance(tree, tuple) else tree


def exact(tree, state):
    """The value of a tree at a state in 40 digits and the largest part of it; no value where it is not real or beside a step."""
    if not isinstance(tree, tuple):
        value = MP.mpf(str(sp.N(tree, 40))) if tree.is_number else MP.mpf(state[0] if tree == V else state[1])
        return value, abs(value)
    values, sizes = zip(*(exact(part, state) for part in tree[1:]), strict=True)
    try:
        value = None if None in values else RULES[tree[0]][1](*values)
    except (ArithmeticError, ValueError):
        value = None
    real = value is not None and isinstance(value, MP.mpf) and MP.isfinite(value)
    return (value, max(*sizes, abs(value))) if real else (None, MP.inf)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(trees)
def test_a_text_has_the_values_of_its_formula(tree):
    """Also in symbols, and over boxes."""
    try:
        formula = symbolic(tree)
    except (ValueError, ArithmeticError, RecursionError):  # sympy's, of minima of what is not real, remainders of zero
        return
    try:
        text = text_of(formula, NAMES)
        read = fold_term(text, NAMES, Numbers())
    except ConditionError:
        assert max(exact(tree, state)[1] for state in STATES) > 1e300
        return
    boxes = np.array(STATES)[:, :, None] + [-1e-3, 1e-3]
    low, high = enclosure_of(text, NAMES)(boxes)
    for k, state in enumerate(STATES):
        value, size = exact(tree, state)
        with np.errstate(all="ignore"):
            found = np.asarray(read(np.array(state))).item()
        if size < 1e3:
            assert abs(found - value) <= 1e-13 * max(1, size) ** 3, (text, state)
            slack = 1e-15 * max(1, size) ** 3  # of constants, which are floats
            assert np.isnan(low[k]) or low[k] - slack <= value <= high[k] + slack, (text, state)


SIMPLE = [
    2 * V / 3 - PHI**2,
    sp.sqrt(2) * V**3,
    sp.exp(-(V**2)) / (1 + PHI),
    sp.pi * sp.cos(PHI - V),
    V ** sp.Rational(-3, 2) * 0.1,
]
SIMPLE += [sp.Max(V, sp.Rational(1, 3), sp.sin(PHI)), sp.Abs(V - PHI) / sp.tan(PHI), -sp.sqrt(V) * (V - 1) / 7 / PHI**2]


@pytest.mark.parametrize("formula", SIMPLE, ids=str)
def test_values_are_those_of_sympy_to_the_last_bits(formula):
    states = np.random.default_rng(4).uniform([0.3, 1.7], [2, 3], (50, 2))
    found = fold_term(text_of(formula, NAMES), NAMES, Numbers())(states.T)
    exactly = sp.lambdify((V, PHI), formula, "mpmath")
    with mpmath.workdps(40):
        expected = np.array([float(exactly(*map(mpmath.mpf, state))) for state in states])
    in_floats = sp.lambdify((V, PHI), formula, "numpy")(*states.T)
    assert (np.abs(found - expected) <= np.abs(in_floats - expected) + 2e-16 * np.abs(expected).max()).all()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_intervals_hold_the_values_of_a_function(name):
    """Over intervals of all sizes; they are wider by little than the values at their ends and at 20 points between."""
    rng = np.random.default_rng(list(FUNCTIONS).index(name))
    low = rng.uniform(-1, 1, (100, 2)) * 10 ** rng.uniform(-2, 1, (100, 1))
    boxes = np.stack([low, low + 10 ** rng.uniform(-9, 0.5, (100, 2))], axis=2)
    text = f"{name}(v, phi)" if name in ("min", "max") else f"{name}(v)"
    ends = enclosure_of(text, NAMES)(boxes)
    inside = boxes[:, :, 0, None] + np.ptp(boxes, axis=2)[:, :, None] * np.linspace(0, 1, 21)
    inside = np.minimum(inside, boxes[:, :, 1, None])
    called = {"abs": abs, "sign": MP.sign, "min": min, "max": max}.get(name) or getattr(MP, name)
    known = ~np.isnan(ends[0])
    assert known.sum() > 20
    for k in np.flatnonzero(known):
        points = zip(*inside[k].tolist(), strict=True) if name in ("min", "max") else inside[k, :1].T.tolist()
        values = [called(*map(MP.mpf, point)) for point in points]
        assert ends[0][k] <= min(values)
        assert max(values) <= ends[1][k]
        size = max(map(abs, values))
        assert ends[1][k] - ends[0][k] <= (max(values) - min(values)) * (1 + 0.1) + 1e-13 * size + 1e-299
    poles = np.isnan(enclosure_of("tan(v)", NAMES)(np.array([[[1.5, 1.6], [0, 0]], [[-8, 8], [0, 0]]]))[0])
    assert poles.all()


def test_a_rounded_value_has_the_sign_of_the_exact_one():
    """So the root of a difference has a value up to where the difference vanishes."""
    low, high = enclosure_of("sqrt(v - 0.1)", NAMES)(np.array([[[0.1, 0.35], [0, 1]]]))
    assert (low[0], high[0]) == (0, pytest.approx(0.5))


CONDITIONS = [
    ((V > 0) & (PHI < 1) | sp.Eq(V, PHI), "((phi < 1) and (v > 0)) or (v == phi)"),
    (sp.Implies(V > 1, PHI > 1), "(phi > 1) or (v <= 1)"),
    (sp.Not((V**2 + PHI**2 <= 0.1) | sp.Ne(V, 1)), "not ((phi**2 + v**2 <= 0.1) or (v != 1))"),
    (sp.true, "0 == 0"),
    (sp.false, "0 == 1"),
]


@pytest.mark.parametrize(("condition", "text"), CONDITIONS, ids=[text for _, text in CONDITIONS])
def test_conditions(condition, text):
    assert text_of(condition, NAMES) == text
    assert sp.simplify_logic(sp.Equivalent(read_condition(text, NAMES).sympy(), condition)) == sp.true


def test_symbols_read_what_was_written():
    for formula in (*SIMPLE, sp.floor(V) + sp.sign(PHI) * sp.asin(V)):
        read = fold_term(text_of(formula, NAMES), NAMES, Symbols(NAMES))
        assert sp.simplify(read - formula) == 0


def test_derivatives_of_steps_are_zero():
    assert text_of(sp.diff(sp.Mod(V**2, 1) + sp.floor(V * PHI) + sp.sign(V - 1), V), NAMES) == "2*v"
    assert text_of(sp.diff(sp.Max(V, PHI), V), NAMES) == "1 - max(-sign(-phi + v), 0)"
    assert text_of(sp.diff(sp.Abs(V - PHI), V), NAMES) == "-sign(phi - v)"


def test_coordinates_may_have_the_names_of_constants_and_of_words():
    names = ("e", "lambda", "pi", "sin")
    e, word, pi, sin = sp.symbols(" ".join(names), real=True)
    text = text_of(sp.E * e + sp.pi * pi - word * sp.sin(sin), names)
    assert fold_term(text, names, Numbers())(np.array([1.0, 2.0, 3.0, 4.0])) == pytest.approx(np.e + 3 * np.pi - 2 * np.sin(4))


def test_long_sums_and_products():
    x = np.array([1.01, 0.0])
    terms = reduce(operator.add, (k * V ** (k % 20) * sp.sin(k * V) for k in range(1, 200)))
    assert fold_term(text_of(terms, NAMES), NAMES, Numbers())(x) == pytest.approx(
        sum(k * 1.01 ** (k % 20) * np.sin(k * 1.01) for k in range(1, 200))
    )
    factors = sp.Mul(*(V + sp.Rational(k, 1000) for k in range(100)))
    assert fold_term(text_of(factors, NAMES), NAMES, Numbers())(x) == pytest.approx(np.prod(1.01 + np.arange(100) / 1000))


REFUSED = [
    (sp.gamma(V), message("reduced.function", function="gamma")),
    (sp.Function("f")(V) + 1, message("reduced.function", function="f")),
    (sp.Symbol("w") > V, message("reduced.not-a-coordinate", name="w", names="phi, v")),
    (sp.Piecewise((V, V > 0), (PHI, True)), message("reduced.by-conditions")),
    (sp.I * V, message("reduced.not-finite-formula", formula="I")),
    (sp.Contains(V, sp.Interval(0, 1)), message("reduced.not-finite-formula")),
]


@pytest.mark.parametrize(("formula", "said"), REFUSED, ids=[said[:20] for _, said in REFUSED])
def test_what_has_no_text_is_refused(formula, said):
    with pytest.raises(ConditionError, match=said):
        text_of(formula, NAMES)
