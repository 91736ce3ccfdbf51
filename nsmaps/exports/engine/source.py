"""The functions of the engine as syntax trees, and the values of the constants that they name."""

import ast
import inspect
import textwrap
from typing import Any

from nsmaps.exports.engine.kinds import Function, Kind
from nsmaps.exports.engine.names import spelt


def function_of(compiled: Any, kinds: list[Kind]) -> Function:
    """The tree of a function that numba compiles, for arguments of these kinds."""
    plain = compiled.py_func
    tree = ast.parse(textwrap.dedent(inspect.getsource(plain))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    names = [spelt(each.arg) for each in tree.args.args]
    return Function(spelt(tree.name), tree, plain.__globals__, dict(zip(names, kinds, strict=True)), {})


def about(function: Function) -> str:
    """The docstring of a function, on one line."""
    return " ".join((ast.get_docstring(function.tree) or "").split())
