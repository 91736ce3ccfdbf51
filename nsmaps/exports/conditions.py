"""How languages write formulas, entries of arrays, and conditions of regions, which decide as `Region.contains` does."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from nsmaps.coordinates import is_angle
from nsmaps.files.expressions import FUNCTIONS
from nsmaps.reduced.conditions.algebras import NUMPY
from nsmaps.reduced.conditions.fold import Algebra, fold, fold_term
from nsmaps.reduced.conditions.region import Box, Region, as_condition


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a language writes what a condition is made of, and entries of arrays."""

    both: str
    either: str
    negate: str
    power: str = "{} ** {}"
    functions: Mapping[str, str] = field(default_factory=dict)  #: by name, where they are called otherwise
    operators: Mapping[str, str] = field(default_factory=dict)  #: by python's, where they are written otherwise
    entry: str = "{}[{}]"  #: of an array
    first: int = 0  #: number of the first entry

    def entries(self, array: str, count: int) -> list[str]:
        """The entries of an array."""
        return [self.entry.format(array, number) for number in range(self.first, self.first + count)]

    def call(self, name: str, *arguments: str) -> str:
        """A call of a function."""
        return f"{self.functions.get(name, name)}({', '.join(arguments)})"

    def condition(self, region: Region, names: Mapping[str, str]) -> str:
        """The condition of a region on variables of the given names, by coordinate; `near(x, middle)` is the nearest turn.

        ConditionError for a region whose condition has no text.
        """
        if type(region) is Box:
            return self.joined(
                self.both, [self._interval(name, names[name], *region.bounds[name]) for name in region.coordinates]
            )
        return fold(as_condition(region).text, region.coordinates, self._writer(region.coordinates, names))

    def term(self, text: str, coordinates: Sequence[str], names: Mapping[str, str]) -> str:
        """The formula of coordinates in a text, on variables of the given names."""
        return fold_term(text, coordinates, self._writer(coordinates, names))

    def _writer(self, coordinates: Sequence[str], names: Mapping[str, str]) -> "_Text":
        return _Text(self, [names[name] for name in coordinates])

    def _interval(self, name: str, variable: str, low: float, high: float) -> str:
        x = f"near({variable}, {number((low + high) / 2)})" if is_angle(name) else variable
        return self.joined(self.both, [f"({number(low)} <= {x})", f"({x} <= {number(high)})"])

    def joined(self, sign: str, parts: Sequence[str]) -> str:
        """Parts with a sign between them, in parentheses."""
        return parts[0] if len(parts) == 1 else f"({f' {sign} '.join(parts)})"


class _Text(Algebra[str, str]):
    """The source text of conditions on variables, by coordinate."""

    def __init__(self, dialect: Dialect, variables: Sequence[str]) -> None:
        self.dialect, self.variables = dialect, variables

    def number(self, value: float) -> str:
        return number(value)

    def coordinate(self, column: int) -> str:
        return self.variables[column]

    def signed(self, sign: str, term: str) -> str:
        return f"({sign}{term})"

    def arithmetic(self, operator: str, left: str, right: str) -> str:
        if operator == "**":
            return f"({self.dialect.power.format(left, right)})"
        return f"({left} {self.dialect.operators.get(operator, operator)} {right})"

    def function(self, name: str, *arguments: str) -> str:
        return self.dialect.call(name, *arguments)

    def relation(self, operator: str, left: str, right: str) -> str:
        return self.arithmetic(operator, left, right)

    def conjunction(self, tests: Sequence[str]) -> str:
        return self.dialect.joined(self.dialect.both, tests)

    def disjunction(self, tests: Sequence[str]) -> str:
        return self.dialect.joined(self.dialect.either, tests)

    def negation(self, test: str) -> str:
        return f"{self.dialect.negate}({test})"


def number(value: float) -> str:
    """A float in as few digits as read back to it; a negative one in parentheses."""
    return repr(float(value)) if value >= 0 else f"({float(value)!r})"


PYTHON = Dialect("&", "|", "np.logical_not", functions={name: f"np.{NUMPY.get(name, name)}" for name in FUNCTIONS})
C = Dialect(
    "&&",
    "||",
    "!",
    power="pow({}, {})",
    functions={"abs": "fabs"} | {name: f"real_{name}" for name in ("sign", "min", "max")},  # fmin ignores what is not real
)
JULIA = Dialect(
    "&&",
    "||",
    "!",
    power="real_power({}, {})",
    # julia's own raise where there is no number
    functions={name: f"real_{name}" for name in ("sin", "cos", "tan", "asin", "acos", "sqrt", "log")},
    first=1,
)
JAVASCRIPT = Dialect(
    "&&",
    "||",
    "!",
    power="Math.pow({}, {})",
    functions={name: f"Math.{name}" for name in FUNCTIONS},
    operators={"==": "===", "!=": "!=="},
)
MATLAB = Dialect(
    "&",
    "|",
    "~",
    power="real_power({}, {})",
    functions={name: f"real_{name}" for name in ("sqrt", "log", "asin", "acos", "min", "max")},
    operators={"*": ".*", "/": "./", "!=": "~="},
    entry="{}(:, {})",
    first=1,
)
