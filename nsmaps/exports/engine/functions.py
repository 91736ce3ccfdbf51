"""The functions that some entries of the engine reach: versions for kinds of arguments, without what these do not need."""

import ast
import inspect
import textwrap
from collections.abc import Iterator
from copy import deepcopy
from functools import cache
from itertools import count
from typing import Any

from nsmaps.exports.engine.folding import Folding
from nsmaps.exports.engine.inference import Inference
from nsmaps.exports.engine.kinds import BOOL, Array, Bound, Function, Kind, Known, Record, spelt


class Functions:
    """Functions by what they are compiled from and the kinds of their arguments, callees first."""

    def __init__(self, own: dict[str, Kind]) -> None:
        """`own` is what those functions return that the program has in place of the engine's."""
        self.own, self.functions, self.folded = own, dict[Any, Function](), dict[Any, Folding]()
        self.public: tuple[str, ...] = ()  #: names by which the program is called, which no function of the engine gets

    def reach(self, node: Any, compiled: Any, kinds: list[Kind]) -> Kind:
        """What the function of a name returns; it and all that it calls are kept."""
        if node.id in self.own:
            return self.own[node.id]
        changed = assigned(source_of(compiled))
        names = compiled.py_func.__code__.co_varnames
        kinds = [BOOL if isinstance(kind, Known) and name in changed else kind for name, kind in zip(names, kinds, strict=False)]
        key = compiled.py_func, *kinds
        if key not in self.functions:
            tree, known = deepcopy(self.fold(compiled, kinds).tree), compiled.py_func.__globals__
            names = [spelt(each.arg) for each in tree.args.args]
            function = Function("", tree, known, dict(zip(names, kinds, strict=True)), {})
            Inference(function, self.reach)
            taken = [*self.public, *(each.name for each in self.functions.values())]
            function.name = next(name for name in numbered(spelt(tree.name)) if name not in taken)
            self.functions[key] = function
        node.called = self.functions[key].name
        return self.functions[key].returns

    def fold(self, compiled: Any, kinds: list[Kind]) -> Folding:
        """The tree of a function that numba compiles, without the parts that its arrays and records do not need."""
        names = compiled.py_func.__code__.co_varnames
        given = {name: kind for name, kind in zip(names, kinds, strict=False) if isinstance(kind, Array | Record | Bound | Known)}
        key = compiled.py_func, *given.items()
        if key not in self.folded:
            tree = deepcopy(source_of(compiled))
            self.folded[key] = Folding(tree, compiled.py_func.__globals__, given, lambda *call: self.fold(*call).result)
        return self.folded[key]


def numbered(name: str) -> Iterator[str]:
    """A name, then the same with numbers behind it."""
    yield name
    yield from (f"{name}_{k}" for k in count(2))


@cache
def source_of(compiled: Any) -> ast.FunctionDef:
    """The tree of a function that numba compiles."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(compiled.py_func))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    return tree


def assigned(tree: ast.AST) -> set[str]:
    """The names that a function assigns to."""
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
