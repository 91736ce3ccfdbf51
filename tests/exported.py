"""Maps of every kind that is exported, made from formulas, and the states at which exports are compared with them."""

from fractions import Fraction
from functools import cache

import numpy as np
import sympy as sp

from nsmaps.coordinates import Angle
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.composite.parametric import ParametricMap
from nsmaps.reduced.conditions.region import Box, ConditionRegion, Region
from nsmaps.reduced.fit.polyfit import PolynomialFit
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.symbolic.curve_iterates import second_iterate
from nsmaps.symbolic.map_iterates import symbolic_iterate

NAMES = ("v", Angle("phi"))
POINTS = 10_000


class Disc(Region):
    """A region of a user's class: the states about a centre, a circle of angles cut where the distance is largest."""

    centre: tuple[float, float]
    radius: float

    def contains(self, states):
        """The first way of a region to state what it is: in numbers."""
        with np.errstate(invalid="ignore"):
            x = self.coordinates.wrap(np.asarray(states, float))
            return np.isfinite(x).all(axis=1) & (((x - self.centre) ** 2).sum(axis=1) < self.radius**2)

    def condition(self):
        """The second: in symbols."""
        x, y = (sp.Symbol(str(name), real=True) for name in self.coordinates)
        return (x - self.centre[0]) ** 2 + (y - self.centre[1]) ** 2 < self.radius**2


def random_map(box, degrees=(3, 2), absolute=(), names=NAMES, seed=0, size=0.3):
    """A map of random coefficients in Chebyshev products of a box, with images near its middle."""
    rng = np.random.default_rng(seed)
    exponents = PolynomialFit(degrees=dict(zip(names, degrees, strict=True))).exponents(names, names[0])
    box = np.array(box, float)
    coefficients = []
    for low, high in box:
        c = rng.normal(size=len(exponents)) * size * (high - low)
        c[0] = (low + high) / 2
        coefficients.append(c)
    centre, scale = box.mean(axis=1), np.ptp(box, axis=1) / 2
    return PolyMap(names, (exponents,) * len(names), tuple(coefficients), centre, scale, box, absolute)


def composite():
    """Pieces of every kind: boxes over the seam, conditions with functions and constants, a reset, an absolute value."""
    where = lambda text: ConditionRegion(text=text, coordinates=NAMES)  # noqa: E731
    pieces = (
        Piece("R1", Box(coordinates=NAMES, bounds={"v": (0.6, 0.9), "phi": (-0.3, 0.5)}),
              random_map([[0.6, 0.9], [-0.3, 0.5]]), "BTB"),
        Piece("R 2", where("v > 0.63 - 0.53*phi and v > 0.55 and not (phi >= pi/3 or sqrt(v - 0.3) < 1/2)"),
              random_map([[0.5, 1.0], [0.3, 1.2]], (5, 4), seed=1), "BB"),
        Piece("R3", where("0.2 < v <= 1 and phi**2*v < 3 or v**0.5*exp(-phi) > e and log(v) < 0.1 and v != 0.25"),
              random_map([[0.2, 1.0], [0.0, 6.2]], (8, 8), ("v",), seed=2, size=0.05), "BTTB"),
        Piece("reset v above", where("v > 1.2 or -phi/2 < -3"), PolyMap.reset(NAMES, {"phi": 1.2})),
        Piece("all round", Box(coordinates=NAMES, bounds={"v": (0.0, 0.1), "phi": (0.0, 6.283185307179586)}),
              random_map([[0.0, 0.1], [0.0, 6.283185307179586]], (1, 2), seed=3)),
    )  # fmt: skip
    return CompositeMap(NAMES, ("B", "T"), pieces)


def parametric():
    """Two pieces whose coefficients are polynomials of d."""
    names, low, high = (*NAMES, "d"), 0.26, 0.35
    made = []
    for seed, box in ((5, [[0.6, 0.9], [0.1, 0.5], [low, high]]), (6, [[0.1, 0.6], [0.1, 3.0], [low, high]])):
        polymap = random_map(box, (3, 2, 2), names=names, seed=seed)
        identity = (np.array([[0, 0, 0], [0, 0, 1]]), np.array([(low + high) / 2, (high - low) / 2]))
        exponents, coefficients = (*polymap.exponents[:2], identity[0]), (*polymap.coefficients[:2], identity[1])
        made.append(PolyMap(names, exponents, coefficients, polymap.centre, polymap.scale, polymap.domain))
    regions = (
        Box(coordinates=NAMES, bounds={"v": (0.6, 0.9), "phi": (0.1, 0.5)}),
        ConditionRegion(text="v < 0.6", coordinates=NAMES),
    )
    pieces = tuple(Piece(f"P{k}", region, each, "BB") for k, (region, each) in enumerate(zip(regions, made, strict=True)))
    return ParametricMap("d", low, high, NAMES, ("B",), pieces, np.array([low, 0.3, high]), 1.5)


def line():
    """A map of one coordinate, which is no angle."""
    return PolyMap.of_monomials(("x",), {"x": {(1,): Fraction(16, 5), (2,): Fraction(-16, 5)}}, [[0, 1]])


def space():
    """A map of three coordinates."""
    return random_map([[0, 1], [1, 3], [-1, 0]], (3, 2, 2), ("y",), ("x", "y", Angle("z")), seed=9)


def awkward():
    """A map whose names are words of languages, or of a kind that a language takes for its own."""
    names = ("end", "lambda")
    region = ConditionRegion(text="end < 0.5", coordinates=names)
    polymap = random_map([[0.0, 1.0], [0.0, 1.0]], names=names)
    return CompositeMap(names, ("B",), (Piece('*/ """ "$x" \\ % 1 & #_{^~', region, polymap),))


def shadowing(own="left"):
    """A map whose names are those of variables and functions that programs use, and whose pieces differ in case only."""
    names = (own, Angle("pow"))
    first = "left**1.5 < 0.5 and left**left > 0.9 and pow > 1"
    last = "sqrt(left) < 0.8 and 1 < pow < 2 or 1/pow < -9 or 6.28 < pow and left > 0.1"
    regions = [
        ConditionRegion(text=text, coordinates=names) for text in (t.replace("left", own) for t in (first, last, "left > 0.9"))
    ]
    maps = [random_map([[0.0, 1.0], [0.0, 1.0]], names=names, seed=seed) for seed in (1, 2, 3)]
    pieces = [Piece(*each) for each in zip(("R1", "r1", "of"), regions, maps, strict=True)]
    return CompositeMap(names, ("B",), tuple(pieces))


def functions():
    """A map whose conditions have every function of the grammar, also where they are not real, and a disc."""
    texts = (
        "min(sqrt(v - 0.5), 1/8) <= 0.1 and tan(phi) < 2 and asin(v) > 0.1",
        "max(asin(phi), -9) >= 0.3 or sign(v - 0.2)*floor(phi) == 2 and not acos(v - 0.6) < 1.5",
        "min(v, phi, 2*v - 0.1) > 0.05 and abs(tanh(v - 0.5)) < 0.3 and cosh(v) < 1.2 and max(v, atan(phi)) < sinh(1)",
    )
    regions = [ConditionRegion(text=text, coordinates=NAMES) for text in texts]
    regions.append(Disc(coordinates=NAMES, centre=(0.9, 6.0), radius=0.4))
    maps = [random_map([[0.0, 1.0], [0.0, 1.0]], seed=seed) for seed in (1, 2, 3, 4)]
    return CompositeMap(NAMES, ("B",), tuple(Piece(f"F{k}", *each) for k, each in enumerate(zip(regions, maps, strict=True))))


def series():
    """Pieces in other functions than monomials: Fourier series, functions with scales and an absolute value, a polynomial."""
    rows = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 2], [0, 0, 3]])
    waves = np.vstack([np.hstack([np.zeros((6, 1), int), rows]), [1, 0, 0, 0]])
    whole = np.array([[-2.0, 2.0], [0.0, 2 * np.pi]])
    values = np.array([0.6, 0.1, 0.2, -0.1, 0.05, 0.03]), np.array([0.3, 0.2, 0.1, -0.2, 0.1, 0.05, 1.0])
    texts = ("sin(phi)", "v", "cos(phi)")
    circle = PolyMap(NAMES, (rows, rows), values[:1] * 2, np.zeros(3), np.ones(3), whole, variables=texts)
    wound = PolyMap(NAMES, (waves[:6], waves), values, np.zeros(4), np.ones(4), whole, variables=("phi", *texts))
    texts = ("exp(-v)*sin(2*phi + 0.3)", "min(abs(v), 1/(1 + phi**2))", "v**3", "sqrt(v)", "floor(phi) - sign(v - 0.5)")
    units = np.vstack([np.zeros((1, 5), int), np.eye(5, dtype=int), [1, 0, 2, 0, 0]])
    rng = np.random.default_rng(4)
    own = PolyMap(
        NAMES, (units, units), tuple(rng.normal(size=(2, 7)) * 0.2), rng.uniform(-1, 1, 5), rng.uniform(0.5, 2, 5),
        np.array([[0.0, 1.0], [-1.0, 1.5]]), ("v",), variables=texts,
    )  # fmt: skip
    where = [ConditionRegion(text=text, coordinates=NAMES) for text in ("phi > 4", "v < 0.3 and phi > 1", "v > 0.1", "v > 0")]
    pieces = zip(
        ("whole", "wound", "own", "plain"), where, (circle, wound, own, random_map([[0.0, 1.0], [0.0, 1.0]])), strict=True
    )
    return CompositeMap(NAMES, ("B",), tuple(Piece(*each) for each in pieces))


@cache
def cases():
    """What is exported, by name: the thing, the box of its states, and its images (and pieces) at states by nsmaps itself."""
    plane, whole, over_d = random_map([[0.5, 1.0], [0.1, 0.9]], absolute=("v",)), composite(), parametric()
    smooth, shadows, script = random_map([[0.5, 1.0], [0.1, 0.9]]), shadowing(), shadowing("Number")
    called, fourier = functions(), series()
    second, second_d = second_iterate(smooth, 0.2, 0.7), second_iterate(over_d, 0.2, 0.4, "min_first", piece="P0")
    third, power = second_iterate(smooth, held=[0.2, 0.3, 0.8], variable="v"), symbolic_iterate(line(), 4)
    return {
        "map": (plane, [[0.4, 1.1], [-0.2, 1.2]], plane),
        "line": (line(), [[-0.1, 1.1]], line()),
        "space": (space(), space().domain, space()),
        "composite": (whole, [[-0.2, 1.5], [-7.0, 14.0]], lambda x: (whole.first_return(x).image, whole.piece_of(x))),
        "shadowing": (shadows, [[-0.5, 1.0], [-1.0, 7.0]], lambda x: (shadows.first_return(x).image, shadows.piece_of(x))),
        "shadowing a script": (script, [[-0.5, 1.0], [-1.0, 7.0]], lambda x: (script.first_return(x).image, script.piece_of(x))),
        "functions": (called, [[-0.5, 1.0], [-1.0, 7.0]], lambda x: (called.first_return(x).image, called.piece_of(x))),
        "series": (fourier, [[-0.5, 1.0], [-1.0, 7.0]], lambda x: (fourier.first_return(x).image, fourier.piece_of(x))),
        "one of a series": (fourier.pieces[2].map, [[0.1, 1.0], [-1.0, 7.0]], fourier.pieces[2].map),
        "parametric": (over_d, [[0.0, 1.0], [0.0, 1.0], [0.25, 0.36]], lambda x: each_value(over_d, x)),
        "second": (second, [[0.5, 1.0]], lambda x: chain(smooth, x, [0.7, 0.2])),
        "second in d": (second_d, [[0.6, 0.9], [0.26, 0.35]], lambda x: chain_of_parametric(over_d, x)),
        "third": (third, [[0.5, 1.0]], lambda x: chain(smooth, x, [0.2, 0.3, 0.8])),
        "fourth": (power, [[0.0, 1.0]], lambda x: line()(line()(line()(line()(x))))),
    }


def chain(polymap, x, held):
    """The first coordinate's image after image, the other held at values in turn."""
    for value in held:
        x = polymap(np.column_stack([x[:, 0], np.full(len(x), value)]))[:, :1]
    return x


def each_value(over_d, states):
    """Images and pieces of a parametric map at states (v, phi, d), for few values of d."""
    images, pieces = np.full((len(states), 2), np.nan), np.full(len(states), -1)
    for d in np.unique(states[:, 2]):
        rows = states[:, 2] == d
        if over_d.low <= d <= over_d.high:
            images[rows], pieces[rows] = (
                over_d.at(d).first_return(states[rows, :2]).image,
                over_d.at(d).piece_of(states[rows, :2]),
            )
    return images, pieces


def chain_of_parametric(over_d, states):
    polymap, (x, d) = over_d.piece("P0").map, states.T
    for phi in (0.2, 0.4):
        x = polymap(np.column_stack([x, np.full(len(x), phi), d]))[:, 0]
    return x[:, None]


def states_of(box, seed=1):
    """Ten thousand states of a box (n, 2), its corners and the edges of intervals among them; a parameter has few values."""
    box = np.array(box, float)
    rng = np.random.default_rng(seed)
    x = rng.uniform(box[:, 0], box[:, 1], (POINTS, len(box)))
    corners = np.stack(np.meshgrid(*box, indexing="ij"), axis=-1).reshape(-1, len(box))
    x[: len(corners)] = corners
    turn = 2 * np.pi
    edges = [-0.0, 0.6, 0.9, -0.3, 0.5, 0.55, np.pi / 3, 0.2, 1.0, 0.25, 1.2, 6.0, 0.1, 0.0]
    edges += [turn, -turn, np.nextafter(0, -1), np.nextafter(turn, 0)]
    for k, (edge, j) in enumerate((edge, j) for edge in edges for j in range(len(box))):
        if box[j, 0] <= edge <= box[j, 1]:
            x[100 + 100 * k : 200 + 100 * k, j] = edge
    if len(box) == 3 and box[2, 1] - box[2, 0] < 0.2:
        x[:, 2] = rng.choice([0.25, 0.26, 0.3, 0.31415, 0.35, 0.36], POINTS)
    return x
