"""Basins and Lyapunov exponents as the rows of tables that a reader of a run's end looks for."""

from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.exact.impacts import Floats
from nsmaps.study.motions import Row

if TYPE_CHECKING:
    from nsmaps.dynamics.basins import Basins, Boundary
    from nsmaps.dynamics.lyapunov import LyapunovSweep

SURE = 2.0  #: standard errors from zero, beyond which an exponent has a sign
LONG = 24  #: letters of words that a row lists
SIGNS = {1: "above zero", -1: "below zero", 0: "not told from zero", None: "none: no map, or the orbit ends"}


def basin_rows(made: "Basins", line: "Boundary | None", returns: int) -> list[tuple[str, str, str, str, str, str]]:
    """Each attractor: its motion, period, words, share of the starts, most returns to arrive, distance from the boundary.

    Then the starts that came to none in so many returns, and those whose orbit ended, where there are some.
    """
    rows = []
    for k, (attractor, share) in enumerate(zip(made.attractors, made.fractions, strict=False)):
        words = " ".join(attractor.words)
        arrival = made.arrival[made.label == k]
        within = str(arrival.max()) if arrival.size else ""
        far = "" if line is None else f"{line.distance(k):.3g}"
        period = str(attractor.period) if attractor.period else "none"
        rows.append((attractor.label, period, words if len(words) <= LONG else "several", _percent(share), within, far))
    rest = {f"none within {returns} returns": made.fractions[-2], "the orbit ends": made.fractions[-1]}
    return rows + [(name, "", "", _percent(share), "", "") for name, share in rest.items() if share > 0]


def exponent_rows(made: "LyapunovSweep") -> list[Row]:
    """The intervals over which the largest exponent has one sign, ascending: `sign`, `from`, `to`, `values`, `exponent`.

    A sign is that of more than two standard errors; `exponent` is the range of the largest one, a return.
    """
    order = np.argsort(made.values, kind="stable")
    values, largest, error = made.values[order], made.at.exponents[order, ..., 0].ravel(), made.at.error[order, ..., 0].ravel()
    signs = [_sign(value, wide) for value, wide in zip(largest.tolist(), error.tolist(), strict=True)]
    rows = list[Row]()
    for sign, run in groupby(range(len(signs)), key=signs.__getitem__):
        held = list(run)
        about = {"sign": SIGNS[sign], "from": float(values[held[0]]), "to": float(values[held[-1]]), "values": len(held)}
        rows.append(about | {"exponent": _range(largest[held])})
    return rows


def _sign(value: float, error: float) -> int | None:
    if np.isnan(value):
        return None
    return 0 if abs(value) <= SURE * error else 1 if value > 0 else -1


def _range(values: Floats) -> str:
    if not len(values) or np.isnan(values).all():
        return ""
    ends = [f"{end:.3g}" for end in (values.min(), values.max())]
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"
