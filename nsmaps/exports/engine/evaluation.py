"""Operators and functions of constants, and what ends a block."""

import ast
import math
import operator
from collections.abc import Callable
from typing import Any

SIGNS: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Pow: operator.pow, ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt,
    ast.GtE: operator.ge, ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Not: operator.not_, ast.USub: operator.neg,
}  # fmt: skip
LEAVING = ast.Return | ast.Break | ast.Continue  #: what ends a block
PLAIN: dict[str, Callable[..., Any]] = {"abs": abs, "min": min, "max": max, "int": int}


class Unknown(Exception):
    """An expression that is not a constant."""


def numeral(value: Any) -> bool:
    """Whether a constant is better read by its name: a finite float."""
    return isinstance(value, float) and math.isfinite(value)
