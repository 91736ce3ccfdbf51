"""Conditions and numbers from text: what they mean, against python and sympy, and what is refused."""

import ast
import math
import pickle
import re

import numpy as np
import pytest
import sympy as sp
from hypothesis import example, given, settings
from hypothesis import strategies as st
from messages import message
from pydantic import BaseModel, ValidationError

from nsmaps.errors import ConditionError
from nsmaps.reduced.conditions.condition import Number, read_condition, read_number

NAMES = ("v", "phi")
ELEMENTARY = ("sqrt", "sin", "cos", "exp", "log", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
PYTHON = {"pi": math.pi, "e": math.e, "__builtins__": {}} | {name: getattr(math, name) for name in ELEMENTARY}
PYTHON |= {"abs": abs, "floor": math.floor, "sign": lambda x: (x > 0) - (x < 0), "min": min, "max": max}

OPERATIONS = (ast.BinOp, ast.UnaryOp, ast.Call)

literal = st.one_of(
    st.integers(0, 99).map("{}.0".format),
    st.floats(0, 1e6, allow_nan=False).map(repr),
    st.sampled_from(["pi", "e", ".5", "1e-3"]),
)


def arithmetic(leaf):
    return st.recursive(
        leaf,
        lambda part: st.one_of(
            st.tuples(part, st.sampled_from(["+", "-", "*", "/", "**"]), part).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
            st.tuples(st.sampled_from([*ELEMENTARY, "abs", "floor", "sign"]), part).map(lambda t: f"{t[0]}({t[1]})"),
            st.tuples(st.sampled_from(["min", "max"]), part, part).map(lambda t: f"{t[0]}({t[1]}, {t[2]})"),
            part.map(lambda t: f"-{t}"),
        ),
        max_leaves=8,
    )


def values(text):
    """The values of an expression and of all its parts, in Python; NaN if one of them has none."""
    parts = (part for part in ast.walk(ast.parse(text, mode="eval").body) if isinstance(part, OPERATIONS))
    try:
        return [eval(text, PYTHON), *(eval(ast.unparse(part), PYTHON) for part in parts)]
    except (ArithmeticError, ValueError, TypeError):  # the last of complex numbers
        return [math.nan]


@settings(max_examples=200, deadline=None)
@given(arithmetic(literal))
@example("(0.0 / (1.0 / 2.2250738585e-313))")  # zero, if its infinite part were allowed
def test_numbers_are_those_of_python(text):
    expected = values(text)
    if any(isinstance(value, complex) or not math.isfinite(value) for value in expected):
        with pytest.raises(ConditionError):
            read_number(text)
    else:
        assert read_number(text) == pytest.approx(expected[0], rel=1e-12, abs=1e-300)


def test_numbers_by_hand():
    assert read_number("pi/3") == math.pi / 3
    assert read_number(" -2**2 ") == -4.0
    assert read_number("2**-1") == 0.5
    assert read_number("2**3**2") == 512.0
    assert read_number("1_000.5") == 1000.5
    assert read_number("+5") == 5.0


class Field(BaseModel):
    x: Number


@pytest.mark.parametrize(("given", "expected"), [(3, 3.0), (2.5, 2.5), ("pi", math.pi), ("-1e-3", -1e-3), (np.float64(2), 2.0)])
def test_a_number_field_takes_numbers_and_text(given, expected):
    field = Field(x=given)
    assert field.x == expected
    assert type(field.x) is float


@pytest.mark.parametrize("given", [True, None, [1], math.inf, math.nan, "", "nan", "inf", "1e999", "1+", "v", {"a": 1}])
def test_a_number_field_refuses_what_is_no_finite_number(given):
    with pytest.raises(ValidationError) as error:
        Field(x=given)
    assert error.value.errors()[0]["loc"] == ("x",)


# ------------------------------------------------------------------------------------------------ conditions
leaf = st.sampled_from(["v", "phi", "0.63", "2", "pi/3", "0.1"])
expression = st.recursive(
    leaf,
    lambda part: st.one_of(
        st.tuples(part, st.sampled_from(["+", "-", "*"]), part).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        part.map(lambda t: f"sin({t})"),
        part.map(lambda t: f"({t})**2"),
        part.map(lambda t: f"exp(-({t})**2)"),
        part.map(lambda t: f"tanh(abs({t}) - 1)"),
        st.tuples(part, part).map(lambda t: f"max({t[0]}, {t[1]}, 1/3)"),
    ),
    max_leaves=4,
)
relation = st.sampled_from(["<", "<=", ">", ">="])
comparison = st.one_of(
    st.tuples(expression, relation, expression).map(" ".join),
    st.tuples(expression, relation, expression, relation, expression).map(" ".join),
)
condition = st.recursive(
    comparison,
    lambda part: st.one_of(
        st.tuples(part, st.sampled_from(["and", "or"]), part).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        part.map(lambda t: f"not ({t})"),
    ),
    max_leaves=3,
)
states = st.lists(st.tuples(st.floats(-2, 2), st.floats(-7, 7)), min_size=1, max_size=4)


def exactly(boolean, state):
    """The truth of a sympy condition at a state, by 50-digit arithmetic; None within rounding of a boundary."""
    v, phi = sp.symbols("v phi", real=True)
    values = {v: sp.Float(float(state[0]), 50), phi: sp.Float(float(state[1]), 50)}
    gaps = [(each.lhs - each.rhs).subs(values).evalf(50) for each in boolean.atoms(sp.core.relational.Relational)]
    if any(abs(gap) < 1e-9 for gap in gaps):
        return None
    truth = boolean.subs(values)
    assert truth in (sp.true, sp.false)
    return bool(truth)


@settings(max_examples=40, deadline=None)
@given(condition, states)
def test_numbers_and_symbols_state_the_same(text, points):
    read = read_condition(text, NAMES)
    symbolic = read.sympy()
    for point, found in zip(points, read(points), strict=True):
        expected = exactly(symbolic, point)
        assert expected is None or found == expected, (text, point)


def test_conditions_by_hand():
    points = [[0.7, 0.3], [0.5, 0.3], [0.5, 2.0], [0.2, 3.5]]
    assert read_condition("v > 0.63 - 0.53*phi and v > 0.55", NAMES)(points).tolist() == [True, False, False, False]
    assert read_condition("phi > pi or phi < 0", NAMES)(points).tolist() == [False, False, False, True]
    assert read_condition("0.3 < v <= 0.5 < phi", NAMES)(points).tolist() == [False, False, True, False]
    assert read_condition("not v == 0.5", NAMES)(points).tolist() == [True, False, False, True]
    assert read_condition("v != 0.5\n and phi > 1", NAMES)(points).tolist() == [False, False, False, True]
    assert read_condition("1 < 2", NAMES)(points).tolist() == [True] * 4
    assert read_condition("1 > 2", NAMES)(np.empty((0, 2))).shape == (0,)


def test_the_order_of_names_is_the_order_of_columns():
    assert read_condition("v < phi", ("phi", "v"))([[2.0, 1.0], [1.0, 2.0]]).tolist() == [True, False]


def test_a_coordinate_may_have_a_constants_name():
    assert read_condition("e > 5", ("e",))([[2.8], [6.0]]).tolist() == [False, True]
    assert read_condition("e > 5", ("e",)).sympy() == sp.Gt(sp.Symbol("e", real=True), 5)


def test_no_condition_holds_at_what_is_no_state():
    for text in ("v < 1", "not v < 1", "v < 1 or not v < 1", "1 < 2"):
        assert not read_condition(text, NAMES)([[np.nan, 0], [0, np.nan], [np.inf, 0], [-np.inf, 0]]).any()


def test_a_comparison_with_what_is_not_real_is_false():
    assert read_condition("sqrt(v) > -1", NAMES)([[-1, 0], [1, 0]]).tolist() == [False, True]
    assert read_condition("sqrt(v) > -1 or phi > 0", NAMES)([[-1, 1], [-1, -1]]).tolist() == [True, False]


@pytest.mark.parametrize("text", ["1 < log(0/v)", "v > 0 and (0/v)**-1 >= phi", "1/(v - v) < 2 < phi"])
def test_what_is_nowhere_finite_has_no_symbols(text):
    condition = read_condition(text, ("v", "phi"))
    assert condition([[0.5, 3.0]]).shape == (1,)
    with pytest.raises(ConditionError, match=message("reduced.no-real-value")):
        condition.sympy()


def test_symbols_are_exact_where_they_can_be():
    v, phi = sp.symbols("v phi", real=True)
    assert read_condition("phi <= pi/3", NAMES).sympy() == sp.Le(phi, sp.pi / 3)
    assert read_condition("v > 0.63 - 0.53*phi and v > 0.55", NAMES).sympy() == sp.And(
        v > sp.Float(0.63) - sp.Float(0.53) * phi, v > sp.Float(0.55)
    )


def test_a_condition_survives_pickling():
    copy = pickle.loads(pickle.dumps(read_condition("v > 1", NAMES)))
    assert copy([[2, 0], [0, 0]]).tolist() == [True, False]


# --------------------------------------------------------------------------------------------------- refused
REFUSED = [  # text, column counted from zero, part of the message
    ("__import__('os').system('true')", 0, message("reduced.not-allowed")),
    ("v > __import__('os')", 4, message("errors.no-such", kind="function", name="__import__")),
    ("v.real > 1", 0, message("reduced.not-allowed", what="'v.real'")),
    ("v > 1 and phi.__class__", 10, message("reduced.not-allowed")),
    ("(lambda: v)() > 1", 0, message("reduced.not-allowed")),
    ("v > (lambda: 1)", 5, message("reduced.not-allowed")),
    ("v > 9**9**9", 4, message("reduced.no-finite-value")),
    ("v > 9**9**9**9**9", 10, message("reduced.no-finite-value")),
    ("v > 1e999", 4, message("reduced.no-finite-value")),
    ("v > 1 - log(0)", 8, message("reduced.no-finite-value")),
    ("v > (-8)**(1/3)", 4, message("reduced.no-finite-value")),
    ("v > 1/0", 4, message("reduced.no-finite-value")),
    ("v/(1 - 1) > 1", 3, message("reduced.divides-by-zero")),
    ("(2*v)**(10**9) > 1", 0, message("reduced.too-high")),
    ("(((2*v)**60)**60)**60 > 1", 0, message("reduced.too-high")),
    ("v > x", 4, message("errors.unknown", kind="name", name="x")),
    ("v > ph", 4, message("errors.unknown-near", kind="name", name="ph", near="phi")),
    ("v > sin", 4, message("reduced.no-argument")),
    ("v > sni(phi)", 4, message("errors.no-such-near", kind="function", name="sni", near="sin")),
    ("v > sin(v, phi)", 4, message("reduced.one-number")),
    ("v > sin(x=phi)", 4, message("reduced.one-number")),
    ("v > sin(*phi)", 8, message("reduced.not-allowed")),
    ("v > max(phi)", 4, message("reduced.two-numbers", function="max")),
    ("v > min()", 4, message("reduced.two-numbers", function="min")),
    ("v > asin(1.5)", 4, message("reduced.no-finite-value")),
    ("v > gamma(phi)", 4, message("errors.no-such", kind="function", name="gamma")),
    ("v", 0, message("reduced.not-a-condition")),
    ("v + 1 and phi > 1", 0, message("reduced.not-a-condition")),
    ("v > (phi > 1)", 5, message("reduced.number-needed")),
    ("not v", 4, message("reduced.not-a-condition")),
    ("v in (1, 2)", 5, message("reduced.comparison")),
    ("v is 1", 5, message("reduced.comparison")),
    ("True", 0, message("reduced.not-allowed")),
    ("v > 1j", 4, message("reduced.not-allowed")),
    ("v > 'a'", 4, message("reduced.not-allowed")),
    ("v > f'{phi}'", 4, message("reduced.not-allowed")),
    ("v > [1][0]", 4, message("reduced.not-allowed")),
    ("[v for v in (1,)]", 0, message("reduced.not-allowed")),
    ("v > 1 if phi > 1 else v > 2", 0, message("reduced.not-allowed")),
    ("(v := 1) > 0", 1, message("reduced.not-allowed")),
    ("v ^ 2 > 1", 0, message("reduced.hat")),
    ("v > 1 & phi > 1", 4, message("reduced.bits")),
    ("v // 2 > 1", 0, message("reduced.not-allowed")),
    ("~v > 1", 0, message("reduced.not-allowed")),
    ("v = 1", 2, message("reduced.equality")),
    ("v > 1 # phi", 6, message("reduced.not-allowed")),
    ("v > 1; phi > 1", 5, message("reduced.unread")),
    ("", 0, message("reduced.empty")),
    ("   ", 0, message("reduced.empty")),
    ("  ü > 1", 2, message("errors.unknown", kind="name", name="ü")),
    ("\0", 0, message("reduced.unread")),
    ("v > 1 and", 8, message("reduced.unread")),
]


@pytest.mark.parametrize(("text", "column", "said"), REFUSED, ids=[text for text, _, _ in REFUSED])
def test_refused_at_its_column(text, column, said):
    with pytest.raises(ConditionError) as error:
        read_condition(text, NAMES)
    assert re.search(said, str(error.value))
    assert f"column {column + 1}: " in str(error.value)
    assert error.value.column == column
    assert "expected: the coordinates v, phi" in str(error.value)


HOSTILE = [
    "v > " + "(" * 400 + "1" + ")" * 400,
    "-" * 900 + "1 > v",
    "not " * 240 + "v > 1",
    "v**" * 300 + "2 > 1",
    "v > " + "1/(" * 220 + "v" + ")" * 220,
    "((" * 60 + "v" + "**1)**1)" * 60 + "> 1",
    "v > 1 or " * 10_000 + "v > 2",
    "v > " + "9" * 5000,
    "9**" * 300 + "9 > v",
    "v" * 10**6,
    "exp(" * 150 + "v" + ")" * 150 + "> 1",
]


@pytest.mark.parametrize("text", HOSTILE, ids=[text[:12] for text in HOSTILE])
def test_hostile_texts_are_refused_at_once(text):
    with pytest.raises(ConditionError) as error:
        read_condition(text, NAMES)
    assert len(str(error.value)) < 600


@pytest.mark.parametrize(
    "text", ["((((v**1)**1)**1)**1)**1 > 1" + " and v > 1" * 20, "v > " + "1/(" * 45 + "v" + ")" * 45, "(2*v)**4000 > 1"]
)
def test_what_is_accepted_is_also_written_out_at_once(text):
    condition, symbols = read_condition(text, NAMES), sp.symbols(NAMES, real=True)
    formula = condition.sympy()
    for row in ([0.25, 0.5], [1.5, 0.5]):
        assert bool(formula.subs(dict(zip(symbols, row, strict=True)))) == condition([row])[0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x", message("errors.unknown", kind="name", name="x")),
        ("1 > 2", message("reduced.number-needed", text="1 > 2")),
        ("9**9**9", message("reduced.no-finite-value", text="9**9**9")),
        ("__import__('os')", message("errors.no-such", kind="function", name="__import__")),
        ("sqrt(-1)", message("reduced.no-finite-value", text="sqrt(-1)")),
        ("1 and 2", message("reduced.number-needed", text="1 and 2")),
        ("1 +", message("reduced.unread", kind="number", text="1 +", column=3)),
        ("()", message("reduced.not-allowed", what="'()'")),
        (3, message("reduced.not-text", text=3, type="int", kind="number")),
        (None, message("reduced.not-text", text="None", type="NoneType", kind="number")),
    ],
)
def test_numbers_are_refused(text, said):
    with pytest.raises(ConditionError, match=said):
        read_number(text)
