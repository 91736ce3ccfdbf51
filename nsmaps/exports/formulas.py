"""Maps with variables as lines of a program: a name and a formula each, in the dialect of a language."""

from collections.abc import Mapping

from nsmaps.exports.conditions import Dialect, number
from nsmaps.exports.program import Part


def lines_of(part: Part, dialect: Dialect, places: Mapping[str, str]) -> tuple[list[tuple[str, str]], list[str]]:
    """The scaled variables s1, s2, ..., their Chebyshev polynomials, such as s2_3, and the images, absolute values not taken.

    Args:
        places: how each coordinate is written in the language.
    """
    polymap, operators = part.polymap, dialect.operators or {}
    times, over = (f" {operators.get(sign, sign)} " for sign in "*/")
    exponents, found = polymap.exponents[: part.outputs], []
    for j, text in enumerate(polymap.variables or ()):
        centre, scale = float(polymap.centre[j]), float(polymap.scale[j])
        value = dialect.term(text, polymap.coordinates, places)
        found.append((_name(j, 1), value if (centre, scale) == (0, 1) else f"({value} - {number(centre)}){over}{number(scale)}"))
        for d in range(2, max(int(each[:, j].max()) for each in exponents) + 1):
            found.append((_name(j, d), f"2.0{times}{_name(j, 1)}{times}{_name(j, d - 1)} - {_name(j, d - 2)}"))
    pairs = zip(exponents, polymap.coefficients, strict=False)
    sums = [
        [
            times.join([number(c), *(_name(j, e) for j, e in enumerate(key) if e)])
            for key, c in zip(keys.tolist(), of, strict=True)
        ]
        for keys, of in pairs
    ]
    return found, [" + ".join(terms) for terms in sums]


def _name(j: int, degree: int) -> str:
    """The name of a Chebyshev polynomial of variable j."""
    return "1.0" if degree == 0 else f"s{j + 1}" if degree == 1 else f"s{j + 1}_{degree}"
