"""A map given by formulas: its cases as a LaTeX document, and as a composite map in the other languages."""

from collections.abc import Callable, Sequence

import sympy as sp

from nsmaps.coordinates import is_angle
from nsmaps.exact.piecewise.formulas import Choices, formulas_of
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.exports.languages.latex import math, number, page, text
from nsmaps.exports.program import MATH_H, Exportable, identifiers
from nsmaps.reduced.composite.formulas import composite_of

Write = Callable[[Exportable, str, Sequence[str]], dict[str, str]]


def piece_files(return_map: PiecewiseMap, language: str, write: Write, name: str | None = None) -> dict[str, str]:
    """The files of a language, by name; formulas with their parameters as symbols in LaTeX, with their values in all others."""
    (own,) = identifiers([type(return_map).__name__.lower()])
    own = name or (f"{own}_" if own in MATH_H.split() else own)
    if language == "latex":
        return {f"{own}.tex": page(f"The map {text(type(return_map).__name__)}", _cases(return_map))}
    values = ", ".join(f"{key} = {value!r}" for key, value in return_map.parameters.items())
    return write(composite_of(return_map), own, [f"The map {type(return_map).__name__}{f' at {values}' if values else ''}."])


def _cases(return_map: PiecewiseMap) -> list[str]:
    formulas, names = formulas_of(Choices.of(return_map)), list(return_map.coordinates)
    known = zip([*formulas.variables, *formulas.symbols], [*names, *return_map.parameters], strict=True)
    plain = {symbol: sp.Symbol(str(name), real=True) for symbol, name in known}
    values = ", ".join(f"${math(name)} = {number(value)}$" for name, value in return_map.parameters.items())
    angles = [f"${math(name)}$" for name in names if is_angle(name)]
    body = [f"Parameters: {values}."] if values else []
    body += [f"Angles, in $[0, 2\\pi)$: {', '.join(angles)}; images are taken modulo $2\\pi$."] if angles else []
    body.append(
        "The first condition that holds decides; a state of none has no image. Pieces: " + ", ".join(formulas.letters) + "."
    )
    for k, name in enumerate(names):
        rows = [
            rf"{math(images[k].xreplace(plain))} & \text{{if }} {math(condition.xreplace(plain))} \\"
            if condition != sp.true
            else rf"{math(images[k].xreplace(plain))} & \text{{otherwise}} \\"
            for condition, images in zip(formulas.conditions, formulas.images, strict=True)
        ]
        head = rf"\[ {math(name)}_{{k+1}} = \begin{{cases}}"
        body.append("\n".join([head, *rows, r"\end{cases} \]"]))
    return body
