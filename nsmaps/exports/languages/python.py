"""A program as a Python module that needs NumPy alone, and evaluates with the very operations of `PolyMap`."""

from collections.abc import Sequence
from inspect import getsource
from pprint import pformat

from nsmaps.exports.conditions import PYTHON
from nsmaps.exports.document import TABLE, document
from nsmaps.exports.plain_data import Document
from nsmaps.exports.program import Exportable, Program, program_of
from nsmaps.reduced.fit import polymap

HEAD = '''"""{about}

{usage}
`nsmaps.load_map` reads the table {table} back as the same map.
"""

import numpy as np
{imported}

Floats = np.ndarray
TWO_PI = 2 * np.pi
ROWS, FLOATS = {rows}, {floats}

{table} = {data}

PARTS = {parts}
OUTPUTS = {outputs}


{evaluation}

def polynomials(part, states):
    """Images of states (N, n): sums of products of Chebyshev polynomials of (x - centre) / scale; shape (N, outputs)."""
    names, terms = [each["name"] for each in part["coordinates"]], part["outputs"][:OUTPUTS]
{sparse}    tensor = np.zeros((OUTPUTS, *np.max([np.max(each["exponents"], axis=0) for each in terms], axis=0) + 1))
    for row, each in zip(tensor, terms):
        np.add.at(row, tuple(np.array(each["exponents"]).T), each["coefficients"])
    scaled = (states - np.array(part["centre"], float)) / np.array(part["scale"], float)
    images = _evaluate(tensor, scaled)
    return np.where([name in part["absolute"] for name in names[:OUTPUTS]], np.abs(images), images)
'''
IMPORTS = "from collections.abc import Sequence\n\nfrom numpy.polynomial.chebyshev import chebvander"
FORMULAS = """# formulas of the coordinates that maps are polynomials in
VARIABLES = {{
{lines}
}}
Ints = np.ndarray


"""
SPARSE = """    if part["variables"] is not None:
        x = np.empty((len(states), len(part["variables"])))
        with np.errstate(all="ignore"):
            for column, text in zip(x.T, part["variables"]):
                column[:] = VARIABLES[text](*states.T)
        scaled = (x - np.array(part["centre"], float)) / np.array(part["scale"], float)
        exponents, coefficients = ([np.array(each[key]) for each in terms] for key in ("exponents", "coefficients"))
        images = _sums(exponents, coefficients, scaled)
        return np.where([name in part["absolute"] for name in names[:OUTPUTS]], np.abs(images), images)
"""
MAP = '''

def {name}(states):
    """Images of states (N, {n}), shape (N, {m})."""
    return polynomials(PARTS[0], np.ascontiguousarray(states, float))
'''
CHAIN = '''

def {name}(states):
    """Images of states (N, {n}), shape (N, {m})."""
    states = np.array(states, float)
    for part in PARTS:
        states[:, :OUTPUTS] = polynomials(part, states)
    return states[:, :OUTPUTS]
'''
PIECES = '''

ANGLES = np.array({angles})
# of each piece the middle of its data, next to which an angle is brought; None where the turn does not matter
MIDDLES = {middles}


def wrap(angle):
    """The angle brought to [0, 2 pi)."""
    wrapped = np.mod(angle, TWO_PI)
    return np.where(wrapped >= TWO_PI, 0.0, wrapped)


def near(angle, middle):
    """The angle on the turn nearest to the middle."""
    return angle - TWO_PI * np.round((angle - middle) / TWO_PI)


def regions({variables}):
    """Where the region of each piece holds, angles in [0, 2 pi): one array a piece, in order."""
    return [
{conditions}
    ]


def {name}(states):
    """Images of states (N, {n}), shape (N, {m}), and the number of the piece of each, from 0, or -1 where there is none."""
    states = np.ascontiguousarray(states, float)
    image, piece = np.full((len(states), OUTPUTS), np.nan), np.full(len(states), -1)
    with np.errstate(all="ignore"):
        seen = np.where(ANGLES, wrap(states), states)
        left = np.isfinite(seen).all(axis=1){limits}
        for number, holds in enumerate(regions(*seen.T)):
            rows = left & holds
            piece[rows] = number
            left = left & ~rows
    for number, part in enumerate(PARTS):
        rows = np.flatnonzero(piece == number)
        if len(rows) == 0:
            continue
        start, middle = states[rows], np.array(MIDDLES[number], float)
        x = np.where(np.isnan(middle), start, near(start, middle))
        moved = polynomials(part, x) + (start - x)[:, :OUTPUTS]
        moved[~np.isfinite(moved).all(axis=1)] = np.nan
        image[rows] = np.where(ANGLES[:OUTPUTS], wrap(moved), moved)
    return image, piece
'''
KINDS = {"map": MAP, "pieces": PIECES, "chain": CHAIN}


def files(result: Exportable, name: str, about: Sequence[str]) -> dict[str, str]:
    """The module, by file name."""
    program, data = program_of(result, name, about), document(result)
    formulas = _formulas(program)
    evaluated = (polymap._evaluate, polymap._sums) if formulas else (polymap._evaluate,)
    images = "images, pieces" if program.kind == "pieces" else "images"
    usage = f"    {images} = {program.name}(states)  # states: shape (N, {len(program.inputs)})"
    head = HEAD.format(
        about="\n".join(program.about).rstrip().replace("\\", "\\\\").replace('"', "'"),
        usage=usage,
        table=TABLE,
        data=_literal(data),
        parts=_parts(program, data),
        outputs=len(program.outputs),
        rows=polymap.ROWS,
        floats=polymap.FLOATS,
        imported=IMPORTS if formulas else "from numpy.polynomial.chebyshev import chebvander",
        evaluation=formulas + "\n\n".join(getsource(each) for each in evaluated),
        sparse=SPARSE if formulas else "",
    )
    names = program.variables
    conditions = [PYTHON.condition(part.region, names) for part in program.parts if part.region is not None]
    body = KINDS[program.kind].format(
        name=program.name,
        n=len(program.inputs),
        m=len(program.outputs),
        variables=", ".join(names.values()),
        angles=[each["angle"] for each in document(program.parts[0].polymap)["coordinates"]],
        conditions="\n".join(f"        {each},  # {part.title}" for each, part in zip(conditions, program.parts, strict=False)),
        middles=_literal([list(part.middles) for part in program.parts]),
        limits="".join(f" & ({low!r} <= seen[:, {i}]) & (seen[:, {i}] <= {high!r})" for i, low, high in program.limits),
    )
    return {f"{program.name}.py": head + body}


def _formulas(program: Program) -> str:
    """The formulas of maps with variables, by their text; none where no map has any."""
    names = program.variables
    texts = dict.fromkeys(text for part in program.parts for text in part.polymap.variables or ())
    lines = [f"    {text!r}: lambda {', '.join(names.values())}: {PYTHON.term(text, program.inputs, names)}," for text in texts]
    return FORMULAS.format(lines="\n".join(lines)) if lines else ""


def _parts(program: Program, data: Document) -> str:
    """Where the module's polynomials are: in its table, or in a list of their own where the table holds monomials."""
    if data["kind"] == "polynomial map":
        return f"[{TABLE}]"
    if "pieces" in data:
        return f'[piece["map"] for piece in {TABLE}["pieces"]]'
    return _literal([document(part.polymap) for part in program.parts])


def _literal(data: object) -> str:
    return pformat(data, width=120, compact=True, sort_dicts=False)
