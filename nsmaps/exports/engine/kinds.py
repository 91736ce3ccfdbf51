"""The kinds of the values that compiled functions handle, and one such function with the kinds of its variables."""

import ast
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Kind = Any  #: one of the following, an `Array`, a `Record`, or a tuple of kinds
FLOAT, INT, BOOL, COMPLEX = "float", "int", "bool", "complex"
CONSTANTS = (bool, int, float)
SHORT = {BOOL: 0, INT: 1, FLOAT: 2, COMPLEX: 3}
OPEN = 0  #: in a shape: as many as there are directions of derivatives, which is known when the program runs
BY_LETTER = {"f": FLOAT, "i": INT, "b": BOOL}  #: of types of NumPy

#: words of C, Julia or JavaScript that are not words of Python
RESERVED = """
    arguments auto begin case catch char const debugger default delete do double end enum eval export extends extern far float
    function global goto implements inline instanceof int interface let local long module near new null package private
    protected public quote register restrict short signed sizeof static struct super switch this throw try typedef typeof union
    unsigned var void volatile where
"""


def spelt(name: str) -> str:
    """A name of the engine as a name of C, of Julia and of JavaScript."""
    return f"{name}_" if name in RESERVED.split() else name


@dataclass(frozen=True, slots=True)
class Array:
    """An array of numbers; `value` holds those of a fixed one."""

    of: Kind
    shape: tuple[int, ...]
    fixed: bool = False
    value: Any = field(default=None, compare=False)

    def at(self, count: int) -> Kind:
        """What is left behind `count` indices."""
        left = self.shape[count:]
        return Array(self.of, left, self.fixed) if left else self.of


@dataclass(frozen=True, slots=True)
class Record:
    """Fields of a named tuple; those of a fixed one, and the `constant` ones, never change; `unused` ones are never read."""

    name: str
    value: Any = field(compare=False)
    fixed: bool = False
    constant: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    dropped: bool = False  #: whether the record itself is such a field

    def kind(self, name: str) -> Kind:
        """The kind of a field."""
        value, fixed = getattr(self.value, name), self.fixed or name in self.constant
        if isinstance(value, tuple):
            return Record(name, value, fixed, dropped=name in self.unused)
        if self.dropped and isinstance(value, np.ndarray):
            return Array(BY_LETTER[value.dtype.kind], value.shape, fixed=True)
        return array_of(value, fixed) if isinstance(value, np.ndarray) else type(value).__name__


@dataclass(frozen=True, slots=True)
class Bound:
    """A compiled function that is handed to another one."""

    compiled: Any


@dataclass(frozen=True, slots=True)
class Known:
    """A truth value that is the same in all calls of a version of a function."""

    value: bool


class Fields(tuple[Kind, ...]):
    """The kinds of a named tuple that a function returns."""

    names: tuple[str, ...]


def array_of(value: Any, fixed: bool) -> Array:
    """The kind of an array."""
    return Array(BY_LETTER[value.dtype.kind], value.shape, fixed, value if fixed else None)


@dataclass(slots=True)
class Function:
    """One function: its tree, whose nodes learn their kinds, its variables, and the names that its module knows."""

    name: str
    tree: ast.FunctionDef
    known: dict[str, Any]
    arguments: dict[str, Kind]  #: by the name in the program, in order
    variables: dict[str, Kind]  #: other than arguments, by the name in the program
    returns: Kind = ""


def joined(one: Kind, other: Kind) -> Kind:
    """The kind that holds values of both."""
    if one == other:
        return one
    if isinstance(one, tuple) and isinstance(other, tuple):
        return tuple(joined(a, b) for a, b in zip(one, other, strict=True))
    return max(one, other, key=lambda kind: SHORT[kind])


def holds(one: Kind, other: Kind) -> bool:
    """True if a variable of the first kind can be given a value of the second."""
    return one == other or (one, other) == (FLOAT, INT)


def passed(kind: Kind) -> bool:
    """Whether an argument is passed on: not a fixed record, which all functions know, nor a function, nor what is known."""
    return not (isinstance(kind, Bound | Known) or kind == () or (isinstance(kind, Record) and kind.fixed))
