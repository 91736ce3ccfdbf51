"""Numbers as JSON and as text: intervals, states, counts of returns."""

from collections.abc import Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from math import floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats

if TYPE_CHECKING:
    from nsmaps.dynamics.planes.plane import ParameterPlane
    from nsmaps.study.reading.values import Span, Sweep
    from nsmaps.study.result import StudyResult

EXACT = "exact map"
COMPOSITE = "composite map"
NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
LISTED = 5  #: parts of a list that a sentence names


def counted(number: int) -> str:
    """A number in words below ten, in digits from ten."""
    return NUMBERS[number] if number < len(NUMBERS) else f"{number:,}"


def count_of(number: int, noun: str) -> str:
    """A number of things, such as `two attractors`."""
    return f"{counted(number)} {noun}{'s' * (number != 1)}"


def cycle_of(period: int) -> str:
    """The name of a cycle with this period, such as two-cycle."""
    return "fixed point" if period == 1 else f"{counted(period)}-cycle" if period < len(NUMBERS) else f"cycle of {period} returns"


def percent(share: float) -> str:
    """A share in percent, to three digits."""
    return f"{100 * share:.3g} %"


def shares_text(shares: "Mapping[str, float]") -> str:
    """Shares by name, the largest first, the smaller ones together."""
    ranked = sorted(((name, share) for name, share in shares.items() if share > 0), key=lambda pair: -pair[1])
    others = sum(share for _, share in ranked[LISTED:])
    more = [f"all others {percent(others)}"] if others else []
    return ", ".join([*(f"{name} {percent(share)}" for name, share in ranked[:LISTED]), *more])


def values_text(values: Sequence[float]) -> str:
    """A few values to six digits, and the number of more."""
    each = list(dict.fromkeys(f"{value:.6g}" for value in values))
    return ", ".join(each[:LISTED]) + (f" and {len(each) - LISTED} more" if len(each) > LISTED else "")


def as_computed(result: "StudyResult", text: str) -> str:
    """A text on the exact map with the name of what was computed: the integrated map, where flights have no closed form."""
    return text.replace(EXACT, result.system.map_name)


def finite(values: Any) -> list[float | None]:
    """Numbers for JSON, shape (n,): None for NaN and infinities."""
    return [float(x) if np.isfinite(x) else None for x in values]


def plain(table: Floats) -> Any:
    """An array of any shape as lists of numbers for JSON: None for NaN and infinities."""
    kept = np.asarray(table, float).astype(object)
    kept[~np.isfinite(table)] = None
    return kept.tolist()


def known(value: float, precision: float) -> str:
    """A value to the digits that are known."""
    return f"{value:.{min(max(-floor(log10(precision)), 0), 15)}f}"


def span_text(values: Floats, none: str = "none") -> str:
    """The least and the greatest of some values to three digits, NaN left out; one of them where they are the same."""
    known = values[~np.isnan(values)]
    ends = [f"{end:.3g}" for end in (known.min(), known.max())] if known.size else [none]
    return " to ".join(dict.fromkeys(ends))


def point(coordinates: Sequence[str], state: Floats) -> str:
    """One state, shape (n,), as `(v = 0.8, phi = 0.3)`."""
    return "(" + ", ".join(f"{name} = {x:.5g}" for name, x in zip(coordinates, state, strict=True)) + ")"


def intervals(coordinates: Sequence[str], box: Floats, inward: bool = False) -> str:
    """Intervals, one per coordinate, rounded to a hundredth of their width or finer, so that a printed claim remains true.

    They are rounded outwards, or inwards for start boxes.
    """
    parts, ways = [], (ROUND_CEILING, ROUND_FLOOR) if inward else (ROUND_FLOOR, ROUND_CEILING)
    for name, (low, high) in zip(coordinates, box, strict=True):
        wide, large = high - low, max(abs(low), abs(high))
        places = 3 - floor(log10(min(wide * 10, large) if wide > 0 else large)) if large > 0 else 0
        unit = Decimal(1).scaleb(-min(places, 17))
        ends = (Decimal(str(x)).quantize(unit, way) for x, way in zip((low, high), ways, strict=True))
        parts.append(f"{name} in [{', '.join(f'{float(end):.15g}' for end in ends)}]")
    return " x ".join(parts)


def grid_text(grid: "Mapping[str, Span] | None") -> str:
    """The number of states of a grid along each coordinate."""
    return f"{' x '.join(str(span.points) for span in (grid or {}).values() if span.points > 1)} states"


def range_text(values: "Sweep") -> str:
    """The values of a parameter."""
    return f"{values.points} values of {values.parameter} from {values.low:g} to {values.high:g}"


def each_text(values: Any) -> str:
    """The values of a parameter, and the returns at each."""
    return f"{range_text(values)}, {values.transient} + {values.n_returns} returns each"


def returns_text(returns: int) -> str:
    """A count of returns."""
    return f"{returns:,} returns"


def computed_text(plane: "ParameterPlane") -> str:
    """How many pixels of a refined plane were computed, and how many of the others may have another motion than that shown."""
    share = f"Orbits of the starts were computed at {100 * plane.computed.mean():.3g} % of the pixels"
    if not plane.probes:
        return f"{share}."
    probed = f"{plane.differing:,} of {plane.probes:,} such pixels, drawn at random and computed as well"
    bound = f"at most {100 * plane.most_differing:.2g} % of those not computed (95 % confidence)"
    return f"{share}; elsewhere attractors of a neighbour are continued. Starts reach another motion at {probed}: {bound}."
