"""The compiled loop of a map given by formulas: its source, in which they are written out, and its compilation."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import entry
from nsmaps.exact.flows.laws import assignments, code
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.piecewise.formulas import PieceFormulas

HEAD = "def orbits(p, words, start, image, turns, codes, outcome, time, rows):"
MOST_TURNS = 2.0**31 - 1
NAMES = {
    **{outcome.name.upper(): int(outcome) for outcome in (Outcome.returned, Outcome.escaped, Outcome.uncovered, Outcome.invalid)},
    "TWO_PI": TWO_PI,
    "MOST": MOST_TURNS,
}


def program(formulas: PieceFormulas, angles: Sequence[bool], by: Sequence[sp.Symbol] = (), kicked: bool = False) -> str:
    """The source of a function that writes the fields of `Returns` for the first n returns of M states (M, dim).

    Its arguments are the parameters, the code of each piece's word, the states, arrays of shape (n, M, ...), and `rows` of shape
    (n, M, dim, number of symbols) for the derivatives of images by some symbols. If it is `kicked`, rows are added to the images
    instead, shape (n, M, dim, 1). Turns are zero before; angles are brought to [0, 2 pi) before conditions are evaluated; an
    outcome that ended an orbit is repeated.
    """
    x, dims = [str(symbol) for symbol in formulas.variables], range(len(formulas.variables))
    lines = [f"    {symbol} = p[{k}]" for k, symbol in enumerate(formulas.symbols)]
    lines += ["    for m in range(len(start)):", "        before = INVALID", *(f"        {x[j]} = start[m, {j}]" for j in dims)]
    lines += ["        for i in range(len(outcome)):"]
    body = [line for j in dims if angles[j] for line in _angle_lines(x[j], j)]
    body += ["piece = -1", *(f"_w{j} = math.nan" for j in dims), f"if {_not_finite(x)}:", "    piece = -2"]
    for number, (condition, images) in enumerate(zip(formulas.conditions, formulas.images, strict=True)):
        slopes = [sp.diff(image, symbol) for image in images for symbol in by]
        places = [f"rows[i, m, {j}, {k}]" for j in dims for k in range(len(by))]
        written = assignments([*images, *slopes], [*(f"_w{j}" for j in dims), *places])
        written += [f"_w{j} = _w{j} + rows[i, m, {j}, 0]" for j in dims if kicked]
        body += [f"elif {code(condition)}:", f"    piece = {number}", *(f"    {line}" for line in written)]
    body += [f"if piece < 0 or {_not_finite([f'_w{j}' for j in dims])}:", "    before = UNCOVERED if piece == -1 else before"]
    body += ["    before = ESCAPED if piece >= 0 else before", "    outcome[i, m], codes[i, m], time[i, m] = before, 0, math.nan"]
    for j in dims:
        body += [f"    {x[j]} = image[i, m, {j}] = math.nan"]
        body += [f"    rows[i, m, {j}, {k}] = math.nan" for k in range(len(by))]
    body += ["else:", "    outcome[i, m], codes[i, m], time[i, m] = RETURNED, words[piece], 1.0"]
    for j in dims:
        body += [f"    {line}" for line in (_image_lines(x[j], j) if angles[j] else [f"{x[j]} = _w{j}"])]
        body += [f"    image[i, m, {j}] = {x[j]}"]
    return "\n".join([HEAD, *lines, *(f"            {line}" for line in body)])


def _not_finite(names: Sequence[str]) -> str:
    """Whether one of some numbers is NaN or infinite."""
    return f"not {' + '.join(f'({name} - {name})' for name in names)} == 0.0"


def _angle_lines(x: str, j: int) -> list[str]:
    """An angle brought to [0, 2 pi), and by how much it was changed."""
    return [f"_a{j} = {x}", f"{x} = {x} % TWO_PI if not 0.0 <= {x} < TWO_PI else {x}", *_below(x), f"_a{j} = _a{j} - {x}"]


def _image_lines(x: str, j: int) -> list[str]:
    """The image of an angle in [0, 2 pi), and its whole turns."""
    turned = f"np.rint((_w{j} + _a{j} - {x}) / TWO_PI)"
    return [f"{x} = _w{j} % TWO_PI", *_below(x), f"turns[i, m, {j}] = min(max({turned}, -MOST - 1.0), MOST)"]


def _below(x: str) -> list[str]:
    """A remainder that was rounded to a whole turn is zero."""
    return [f"{x} = {x} if {x} < TWO_PI or {x} != {x} else 0.0"]


@lru_cache(maxsize=256)
def compiled_program(source: str) -> Any:
    """The function of a source, compiled when it is first called, and kept in the folder of compiled code."""
    names: dict[str, Any] = {"math": math, "np": np, "__name__": __name__, **NAMES}
    exec(compile(source, "<map>", "exec"), names)
    return entry(names["orbits"])
