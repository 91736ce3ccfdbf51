"""Parts of a program as text in the dialect of a language: states and images are arrays `state` and `image` there."""

from collections.abc import Sequence

from nsmaps.exports.conditions import Dialect, number
from nsmaps.exports.program import Part, Program


def scaled_inputs(part: Part, dialect: Dialect, state: str = "state") -> list[str]:
    """The scaled inputs of a part without variables."""
    polymap = part.polymap
    each = zip(dialect.entries(state, len(polymap.centre)), polymap.centre, polymap.scale, strict=True)
    return [f"({x} - {number(centre)}) / {number(scale)}" for x, centre, scale in each]


def images_of(part: Part, dialect: Dialect, values: Sequence[str]) -> list[str]:
    """The images from the values of polynomials, whose absolute values are taken where the part says so."""
    return [dialect.call("abs", value) if taken else value for value, taken in zip(values, part.absolute, strict=True)]


def seen_by_regions(program: Program, dialect: Dialect, state: str = "state") -> list[tuple[str, str]]:
    """The variables of conditions, each with its value: angles in [0, 2 pi)."""
    inputs = program.inputs
    each = zip(program.variables.values(), dialect.entries(state, len(inputs)), inputs.angles, strict=True)
    return [(name, f"wrap({x})" if angle else x) for name, x, angle in each]


def admissible(program: Program, dialect: Dialect, is_finite: str = "isfinite", state: str = "state") -> str:
    """Whether all variables of conditions are finite, and within their limits."""
    x = dialect.entries(state, len(program.inputs))
    tests = [f"{is_finite}({name})" for name in program.variables.values()]
    tests += [f"{number(low)} <= {x[i]} {dialect.both} {x[i]} <= {number(high)}" for i, low, high in program.limits]
    return f" {dialect.both} ".join(tests)


def starts_of(part: Part, dialect: Dialect) -> str:
    """The inputs of a part, angles on the turn of its data."""
    each = zip(dialect.entries("state", len(part.middles)), part.middles, strict=True)
    return ", ".join(x if middle is None else f"near({x}, {number(middle)})" for x, middle in each)


def wrapped_angles(program: Program, dialect: Dialect, state: str = "state") -> list[str]:
    """Assignments by which the images of angles, which follow the turns of the state, come to [0, 2 pi)."""
    arrays = (dialect.entries(array, len(program.outputs)) for array in ("image", state, "x"))
    each = zip(*arrays, program.outputs.angles, strict=True)
    return [f"{image} = wrap({image} + ({before} - {x}))" for image, before, x, angle in each if angle]


def lines_of(part: Part, dialect: Dialect, state: str = "state") -> tuple[list[tuple[str, str]], list[str]]:
    """The scaled variables s1, s2, ..., their Chebyshev polynomials, such as s2_3, and the values of the polynomials."""
    polymap, operators = part.polymap, dialect.operators
    places = dict(zip(polymap.coordinates, dialect.entries(state, len(polymap.coordinates)), strict=True))
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
