"""A small result to draw: a linear map of (v, phi) with two words, its pieces, orbits and domains."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from nsmaps.auxiliary.cells import Cells
from nsmaps.auxiliary.cover import MorseCover
from nsmaps.auxiliary.domain import attracting_domain
from nsmaps.auxiliary.iterate import SecondIterate
from nsmaps.auxiliary.transient import Transient
from nsmaps.dynamics.basins import basins
from nsmaps.dynamics.bifurcation import bifurcation
from nsmaps.dynamics.branch import continue_branch
from nsmaps.dynamics.impactdiagram import ImpactDiagram
from nsmaps.dynamics.lyapunov import Lyapunov, LyapunovSweep
from nsmaps.dynamics.noise import Noise
from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.dynamics.residence import Residence
from nsmaps.dynamics.stability import EventCurve, StabilityDiagram
from nsmaps.exact.impacts import Angle, Impacts, Returns, encode, wrap
from nsmaps.exact.slices import Slice
from nsmaps.exact.surface import Axis, Grid, Surface
from nsmaps.exact.track import Track
from nsmaps.figures.style import units_of
from nsmaps.reduced.composite import CompositeMap, Piece
from nsmaps.reduced.deltas import compare_deltas
from nsmaps.reduced.diagonal import Diagonal, diagonal_region
from nsmaps.reduced.polyfit import Full
from nsmaps.reduced.polymap import PolyMap
from nsmaps.reduced.region import Box, Where
from nsmaps.reduced.speed import Speed

COORDINATES = ("v", Angle("phi"))
WALLS = ("B", "T")
GRID = Grid(axes={"v": Axis(low=0.1, high=1.0, points=37), "phi": Axis(low=0.0, high=np.pi, points=41)})
ORDERS = {"poly11": Full(degrees={"v": 1, "phi": 1}), "poly01": Full(degrees={"v": 1, "phi": 0})}
LINEAR = np.array([[0, 0], [0, 1], [1, 0]])


def linear(v_row: tuple[float, ...], phi_row: tuple[float, ...]) -> PolyMap:
    """The map with these coefficients of 1, phi, v."""
    plain = np.zeros(2), np.ones(2), np.array([[0.0, 1.0], [0.0, np.pi]])
    return PolyMap(COORDINATES, (LINEAR, LINEAR), (np.array(v_row), np.array(phi_row)), *plain)


COUPLED = linear((0.95, -0.15, -0.2), (0.5, -0.3, 0.05))
SEPARABLE = PolyMap(
    COORDINATES,
    (np.array([[0, 0], [1, 0]]), np.array([[0, 0], [0, 1]])),
    (np.array([0.9, -0.2]), np.array([0.5, -0.1])),
    np.zeros(2),
    np.ones(2),
    np.array([[0.0, 1.0], [0.0, np.pi]]),
)


class Toy:
    """The coupled map, as if of an exact system: word BTB above a line, BB below it."""

    coordinates = COORDINATES
    dimensionless = True

    def first_return(self, states: Any, derivative: bool = False) -> Returns:
        start = np.asarray(states, float)
        image = COUPLED(start)
        image[:, 1] = wrap(image[:, 1])
        codes = np.where(start[:, 0] > 0.5 - 0.2 * start[:, 1], encode("BTB", WALLS), encode("BB", WALLS))
        blank = np.zeros(len(start))
        return Returns(COORDINATES, WALLS, start, image, 0 * start.astype(np.int32), codes, blank.astype(np.int8), blank)


def strips() -> SimpleNamespace:
    """Two leaves of different degrees with an edge between them, which the raster leaves out."""
    leaf, raster = np.zeros((2, 14)), np.repeat([[0] * 15 + [-1] * 2 + [1] * 15], 32, axis=0)
    leaf[:, 12] = 4, 8
    curves = np.array([[0.0, 0.0], [1.5, 0.2], [np.pi, 0.0]])
    slab = SimpleNamespace(speeds=lambda s: 0.1 + 0.45 * (1 + s), phases=lambda s: curves[:, :1] + curves[:, 1:] * s)
    return SimpleNamespace(
        bounds=np.array([(0.1, 1.0), (0.0, np.pi)]),
        slabs=(slab,),
        report=SimpleNamespace(degrees={4: 1, 8: 1}),
        tables=SimpleNamespace(leaf=leaf, raster=raster),
    )


def tracked() -> Track:
    """Three impacts, B T B, two flights of five instants, and walls that move."""
    impacts = Impacts(
        WALLS,
        np.array([0, 1, 0], np.int8),
        np.array([0.0, 1.0, 3.0]),
        np.array([0.5, 3.0, 6.0]),
        np.array([0.4, 0.6, 0.8]),
        np.array(["", "", ""]),
    )
    time = np.array([np.linspace(0, 1, 5), np.linspace(1, 3, 5)])
    place = np.array([np.linspace(0.2, -0.2, 5), np.linspace(-0.2, 0.2, 5)])
    walls = np.array([np.sin(time) - 0.2, np.sin(time) + 0.2])
    rate = np.array([np.full(5, -0.4), np.full(5, 0.2)])
    return Track(impacts, np.array([1, -1], np.int8), np.array([0.2, -0.2]), time, place, rate, np.sin(time) - place, walls)


def cut() -> Slice:
    """Images of the toy along v at phi = 1, where its word changes once, at v = 0.3; a jump is said to be at 0.7."""
    x = np.linspace(0, 1, 11) + 1e-9
    jump = np.zeros(10, bool)
    jump[6] = True
    return Slice("v", {"phi": 1.0}, Toy().first_return(np.column_stack([x, np.ones(11)])), jump)


def covers() -> dict[str, Any]:
    """Two components with a cell between them, one minimal; a region of which one cell stays, and one around it that is left."""
    cells = Cells(COORDINATES, np.array([[0.0, 1.0], [0.0, np.pi]]), (4, 4))
    component, edges = np.array([1, -1, 0, 0]), np.array([[1, 0]])
    hulls = np.array([cells.hull(np.array(numbers)) for numbers in ([10, 11], [5])])
    morse = MorseCover("exact map", cells, np.array([5, 6, 10, 11]), component, edges, hulls, np.ones(4, bool), (), True)
    region = np.repeat([0, 1, 1, -1], 4)
    left = np.where(np.arange(16) == 5, -1, 1 + np.arange(16) % 3)
    arrived = np.where(np.arange(16) < 8, -1, np.arange(16) % 4)
    cycle = SimpleNamespace(states=np.array([[0.3, 1.2]]))
    return {"morse": morse, "transient": Transient("exact map", cells, ("R1", "R2"), region, left, arrived, (cycle,))}


def swept(surface: Surface) -> list[tuple[float, Surface]]:
    """The surface at one of four values of a parameter, and parts of it at the others."""
    parts = [surface.restricted(surface.start[:, 0] > v) for v in (0.7, 0.72, 0.74)]
    return list(zip((0.3, 0.23, 0.17, 0.1), (surface, *parts), strict=True))


def _gated(value: float) -> Toy:
    """The toy at values that are not negative."""
    if value < 0:
        raise ValueError("negative")
    return Toy()


def _fixed(d: float) -> CompositeMap:
    """The coupled map with an attracting fixed point that moves with a parameter."""
    moved = linear((0.9 + d / 2, -0.15, -0.2), (0.5, -0.3, 0.05))
    return CompositeMap(COORDINATES, WALLS, (Piece("R1", Where(text="v > 0", coordinates=COORDINATES), moved, "BTB"),))


def _stability() -> dict[str, Any]:
    """A branch in d, motions at three values of d by two of r, and a curve between them."""
    one = continue_branch(_fixed, periodic_orbit(_fixed(0.1), [0.7, 0.4]), 0.1, (0.0, 0.2))
    along, across = np.array([0.0, 0.1, 0.2]), np.array([0.4, 0.6])
    period, labels = np.array([[2, 1, 1], [2, 2, 1]]), np.array([["1:1/2T", "1:1/T", "1:1/T"], ["1:1/2T", "1:1/2T", "1:1/T"]])
    made = StabilityDiagram(along, across, period, labels, np.zeros((2, 3), np.int8), ("", ""))
    curve = EventCurve("period doubling", np.array([0.05, 0.15]), across, np.zeros(2), ("", ""))
    return {"branches": {"one": (one,)}, "stability": made, "curves": {"period doubling of one": curve}}


def _exponents() -> LyapunovSweep:
    """One value without a map, one with exponents of -1 and -2."""
    one, two = np.full((3, 2), [-1.0, -2.0]), np.full((3, 2), 0.1)
    one[1] = np.nan
    made = Lyapunov(COORDINATES, 64, one, two, one / 2, two / 2, one.sum(axis=1), one[:, None], np.zeros(3, np.int8), one)
    return LyapunovSweep(np.array([0.3, 0.1, 0.2]), ("", "none", ""), made)


def _noisy() -> SimpleNamespace:
    """Two sizes of noise and impacts down and up, with and without."""
    values, wall, speed = (
        np.array([0.2, 0.1]),
        np.array([[0.0, 1, 0], [0, 1, np.nan]]),
        np.array([[0.5, 0.3, 0.6], [0.4, 0.2, np.nan]]),
    )
    sizes = Noise(sigma=0, tau=1), Noise(sigma=0.1, tau=1)
    impacts = tuple(ImpactDiagram(WALLS, size, follow, values, wall, speed) for follow in ("down", "up") for size in sizes)
    switches = np.array([[0, 3], [4, 0]])
    stays = tuple(Residence(("one", "two"), 6, np.array([50.0, 10.0]), 1.0, switches * k) for k in range(2))
    return SimpleNamespace(sigma=(0.0, 0.1), stays=stays, impacts=impacts)


@pytest.fixture(scope="session")
def result() -> SimpleNamespace:
    """Everything that a study could have computed of the toy."""
    returns = Toy().first_return(GRID.states())
    members = {word: returns.has_word(word) for word in ("BB", "BTB")}
    surfaces = {word: Surface(word, GRID, member, returns.select(member)) for word, member in members.items()}
    pieces = (
        Piece("reset", Where(text="phi > pi", coordinates=COORDINATES), PolyMap.reset(COORDINATES, {"phi": 1.2})),
        Piece("R1", Box.of(COORDINATES, [[0.6, 0.95], [0.1, 0.8]]), COUPLED, "BTB"),
        Piece("R2", Where(text="v > 0.3", coordinates=COORDINATES), SEPARABLE, "BTB"),
    )
    composite = CompositeMap(COORDINATES, WALLS, pieces)
    starts = ([0.35, 1.5], [0.9, 2.5])
    orbits = [SimpleNamespace(exact=orbit(Toy(), x, 40), composite=orbit(composite, x, 40), track=tracked()) for x in starts]
    fits = {
        "R1": SimpleNamespace(separable=None),
        "R2": SimpleNamespace(separable={"v": 1, "phi": 1}, along={"v": 0.83, "phi": 1.0}),
    }
    domains = {
        "fitted": attracting_domain(COUPLED, [[0.6, 0.95], [0.1, 0.8]], 5, samples=31, of="fitted map R1"),
        "loose": attracting_domain(Toy(), [[0.9, 0.95], [0.1, 0.8]], 5, samples=31, of="exact map"),
    }
    return SimpleNamespace(
        study=SimpleNamespace(
            system="vi_pair",
            bifurcation=SimpleNamespace(parameter="d"),
            branches=(SimpleNamespace(name="one", parameter="d"),),
            stability=SimpleNamespace(along=SimpleNamespace(parameter="d"), across=SimpleNamespace(parameter="r")),
            lyapunov=SimpleNamespace(parameter="d"),
            noise=SimpleNamespace(impacts=SimpleNamespace(parameter="d")),
            second_iterate=SimpleNamespace(domain="fitted"),
            partition=SimpleNamespace(tolerance=1e-3),
            diagonal=SimpleNamespace(family="BTB", sweep=SimpleNamespace(parameter="d", low=0.3, high=0.1, points=4)),
            composite=tuple(SimpleNamespace(name=piece.name, family="BTB", fit=fits.get(piece.name)) for piece in pieces),
        ),
        surfaces=surfaces,
        slices=(cut(),),
        diagonal=diagonal_region(Diagonal(delta=1.2), swept(surfaces["BTB"])),
        near=compare_deltas(Diagonal(delta=1.2), surfaces["BTB"], [1.4], ORDERS),
        composite=composite,
        partition=SimpleNamespace(
            composite=composite,
            attracting=("R1",),
            table=lambda: [SimpleNamespace(name="R1.1"), SimpleNamespace(name="R2.3")],
            log=[SimpleNamespace(became=text) for text in ("split along v", "accepted", "accepted: right", "given up: small")],
        ),
        accurate=SimpleNamespace(strips=strips(), uniform=SimpleNamespace(largest=2e-4), beside=SimpleNamespace(largest=5e-4)),
        speed=Speed(exact=100.0, composite=20.0),
        system=Toy(),
        orbits=orbits,
        bifurcation={"exact": bifurcation(_gated, np.linspace(-0.1, 1, 12), [0.1, 0.5], returns=10, transient=0)},
        **_stability(),
        lyapunov=_exponents(),
        basins=basins(Toy(), GRID, returns=50),
        boundary=None,
        noise=_noisy(),
        domains=domains,
        second_iterate=SecondIterate("v", None, (0.7, 0.04), None, None, "min_first"),
        **covers(),
    )


@pytest.fixture(autouse=True)
def dimensionless() -> Iterator[None]:
    """Labels as in figures of a system that says that it is dimensionless."""
    with units_of(Toy()):
        yield


@pytest.fixture
def ax() -> Axes:
    """Axes of a figure of the caller's own, made without pyplot."""
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure.add_subplot()


@pytest.fixture
def ax3d() -> Axes:
    """Three-dimensional axes."""
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure.add_subplot(projection="3d")
