"""Maps as JavaScript that follow a parameter: the numbers of a script that change with it are affine in it."""

import re
from collections.abc import Callable, Sequence
from math import ulp

from nsmaps.exact.systems.parameters import System

_NUMBER = re.compile(r"(?<![\w.])(-?\d+\.\d*(?:e[+-]?\d+)?)(?!\w)")  #: a float as it is printed
_SHARES = (0.0, 1.0, 0.371)  #: of the range: two values that make the formulas, and one that tests them
_ULPS = 4  #: in the last place, by which a formula may miss a number


def moving_script(
    system: System, parameter: str, low: float, high: float, name: str, write: Callable[[System], str]
) -> str | None:
    """The script that `write` makes of a system as `name.at(value)`, for a parameter between two values.

    None where scripts at other values differ in more than their numbers, or in numbers that are not affine in the parameter, to
    four units in the last place at a third value.
    """
    values = [low + share * (high - low) for share in _SHARES]
    bodies = [write(system.at(**{parameter: value})).split("*/", 1)[1] for value in values]
    first, *others = (_NUMBER.split(body) for body in bodies)
    parts = list(first)
    for k, text in enumerate(first):
        column = [text, *(other[k] if len(other) == len(first) else "" for other in others)]
        if len(set(column)) > 1:
            formula = _affine(values, [float(each) for each in column]) if k % 2 else None
            if formula is None:
                return None
            parts[k] = formula
    return f"const {name} = {{at: parameter => {{{''.join(parts)}\nreturn {name}\n}}}}\n"


def _affine(values: Sequence[float], numbers: Sequence[float]) -> str | None:
    """The numbers as a + b times the parameter, with short coefficients where these are as good."""
    slope = (numbers[1] - numbers[0]) / (values[1] - values[0])
    for b in (float(f"{slope:.12g}"), slope):
        offset = numbers[0] - b * values[0]
        for a in (0.0, float(f"{offset:.12g}"), offset):
            if all(abs(a + b * x - y) <= _ULPS * ulp(y) for x, y in zip(values, numbers, strict=True)):
                return f"({a!r} + {b!r} * parameter)"
    return None
