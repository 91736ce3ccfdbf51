"""Results to draw: those of stored runs, and one whose parts are computed of a linear map of (v, phi) with two words."""

from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from inspect import signature
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from nsmaps_vi_pair import VIPair

from nsmaps import read_result
from nsmaps.auxiliary.attracting_domain import attracting_domain
from nsmaps.auxiliary.full_map import AuxiliaryRegion, auxiliary_orbit
from nsmaps.cells.grid import Cells
from nsmaps.cells.morse import MorseCover
from nsmaps.cells.times import ExitTimes
from nsmaps.coordinates import Angle, wrap
from nsmaps.dynamics.attractors.basins import basins
from nsmaps.dynamics.attractors.limit_set import OrbitPair
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram
from nsmaps.dynamics.lyapunov import LyapunovSweep
from nsmaps.dynamics.noise.impacts import ImpactDiagram
from nsmaps.dynamics.noise.orbits import Noise
from nsmaps.dynamics.noise.residence import NoiseResult, Residence
from nsmaps.dynamics.observables.attractors import AttractorMeans
from nsmaps.dynamics.observables.means import Mean
from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.exact.events import Track
from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Impacts, Returns
from nsmaps.exact.surfaces.slice import Slice
from nsmaps.exact.surfaces.surface import Axis, Grid, Surface
from nsmaps.exact.words import encode
from nsmaps.figures.style import drawing
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import Box, ConditionRegion
from nsmaps.reduced.fit.filter import NearDiagonal, diagonal_region
from nsmaps.reduced.fit.filter_errors import compare_deltas
from nsmaps.reduced.fit.polyfit import PolynomialFit
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.reduced.partition.result import PartitionResult
from nsmaps.reduced.validation.speed import Speed
from nsmaps.results import units_of
from nsmaps.study.result import StudyResult
from nsmaps.study.store.archive import FORMAT
from nsmaps.study.study import CATALOGUE, Study
from nsmaps.symbolic.curve_iterates import SecondIterate

COORDINATES = ("v", Angle("phi"))
WALLS = ("B", "T")
GRID = Grid(axes={"v": Axis(low=0.1, high=1.0, points=37), "phi": Axis(low=0.0, high=np.pi, points=41)})
ORDERS = {"poly11": PolynomialFit(degrees={"v": 1, "phi": 1}), "poly01": PolynomialFit(degrees={"v": 1, "phi": 0})}
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


STORED = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}"
START = {"v": 0.83, "phi": 0.36}
SECTIONS: dict[str, Any] = {
    "system": "vi_pair",
    "parameters": {"d": 0.35, "r": 0.5, "g_bar": 0.2113},
    "diagonal": {"family": "BTB", "delta": 1.2, "sweep": {"parameter": "d", "from": 0.3, "to": 0.1, "points": 4}},
    "composite": [
        {"name": "reset", "where": "phi > pi", "reset": {"phi": 1.2}},
        {"name": "R1", "box": {"v": [0.6, 0.95], "phi": [0.1, 0.8]}, "family": "BTB", "fit": {"full": {"v": 1, "phi": 1}}},
        {
            "name": "R2",
            "where": "v > 0.3",
            "family": "BTB",
            "fit": {"separable": {"v": 1, "phi": 1}, "lines": {"v": 0.83, "phi": 1.0}},
        },
    ],
    "partition": {"tolerance": 1e-3},
    "bifurcation_diagram": {"parameter": "d", "from": 0.1, "to": 1, "points": 12, "starts": [START]},
    "branches": [{"name": "one", "parameter": "d", "bounds": [0.1, 1], "start": START}],
    "parameter_plane": {
        "axes": {"d": {"from": 0, "to": 0.2, "points": 3}, "r": {"from": 0.4, "to": 0.6, "points": 2}},
        "starts": [START],
    },
    "observe": {"observables": ["loss", "speed"]},
    "lyapunov": {"parameter": "d", "from": 0.1, "to": 0.3, "points": 3, "starts": [START]},
    "global_continuation": {"parameter": "d", "from": 0.1, "to": 0.3, "points": 3, "box": {"v": [0, 1], "phi": [0, 1]}},
    "noise": {
        "sigma": [0, 0.1],
        "tau": 1,
        "start": START,
        "modes": {"one": ["BB"], "two": ["BTB"]},
        "impacts": {"parameter": "d", "from": 0.1, "to": 0.2, "points": 2, "sigma": 0.1},
    },
    "second_iterate": {"domain": "fitted"},
    "auxiliary_map": {"domain": "fitted", "box": {"v": [0.1, 1], "phi": [0, 3]}, "start": START},
}  #: of a study that names what the result of the toy has


def study_of(**changed: Any) -> Study:
    """The study of the toy with other sections in place of some of its own."""
    return Study.model_validate(SECTIONS | changed)


class Toy(ReturnMap):
    """The coupled map, as if of an exact system: word BTB above a line, BB below it."""

    coordinates = COORDINATES
    dimensionless = True
    units = MappingProxyType({})

    def first_return(self, states: Any, derivative: bool = False) -> Returns:
        start = np.asarray(states, float)
        lifted = COUPLED(start)
        image = np.column_stack([lifted[:, 0], wrap(lifted[:, 1])])
        turns = np.round((lifted - image) / (2 * np.pi)).astype(np.int32)
        codes = np.where(start[:, 0] > 0.5 - 0.2 * start[:, 1], encode("BTB", WALLS), encode("BB", WALLS))
        blank = np.zeros(len(start))
        return Returns(COORDINATES, WALLS, start, image, turns, codes, blank.astype(np.int8), blank)


class ToyPair(VIPair):
    """The system of the study, whose map is the toy."""

    def first_return(self, states: Any, derivative: bool = False) -> Returns:  # type: ignore[override]
        return Toy().first_return(states, derivative)

    def itineraries(self, states: Any) -> Returns:  # type: ignore[override]
        return Toy().first_return(states)  # of which only the codes are read


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
    cycle = periodic_orbit(_fixed(0.1), [0.7, 0.4])
    return {"morse_sets": morse, "exit_times": ExitTimes("exact map", cells, ("R1", "R2"), region, left, arrived, (cycle,))}


def swept(surface: Surface) -> list[tuple[float, Surface]]:
    """The surface at one of four values of a parameter, and parts of it at the others."""
    parts = [surface.restrict(surface.start[:, 0] > v) for v in (0.7, 0.72, 0.74)]
    return list(zip((0.3, 0.23, 0.17, 0.1), (surface, *parts), strict=True))


def _gated(value: float) -> Toy:
    """The toy at values that are not negative."""
    if value < 0:
        raise ValueError("negative")
    return Toy()


def _fixed(d: float) -> CompositeMap:
    """The coupled map with an attracting fixed point that moves with a parameter."""
    moved = linear((0.9 + d / 2, -0.15, -0.2), (0.5, -0.3, 0.05))
    return CompositeMap(COORDINATES, WALLS, (Piece("R1", ConditionRegion(text="v > 0", coordinates=COORDINATES), moved, "BTB"),))


def _observed() -> AttractorMeans:
    """Two observables at twelve values, of which the first has no map."""
    chosen = (Observable(name="loss", formula="v", unit="J"), Observable(name="speed", formula="v", per="1"))
    table = np.arange(24.0).reshape(12, 1, 2)
    table[0] = np.nan
    mean = Mean(table, table / 100)
    return AttractorMeans(chosen, mean, mean, mean, parameter="d", values=np.linspace(-0.1, 1, 12))


def _exponents() -> LyapunovSweep:
    """One value without a map, one with exponents of -1 and -2."""
    one, two = np.full((3, 2), [-1.0, -2.0]), np.full((3, 2), 0.1)
    one[1] = np.nan
    tables = one, two, one / 2, two / 2, one.sum(axis=1), one[:, None], np.zeros(3, np.int8), one
    return LyapunovSweep(COORDINATES, 64, *tables, "d", np.array([0.3, 0.1, 0.2]), ("", "none", ""))


def _noisy() -> NoiseResult:
    """Two sizes of noise and impacts down and up, with and without."""
    values, wall, speed = (
        np.array([0.2, 0.1]),
        np.array([[0.0, 1, 0], [0, 1, np.nan]]),
        np.array([[0.5, 0.3, 0.6], [0.4, 0.2, np.nan]]),
    )
    sizes = Noise(sigma=0, tau=1), Noise(sigma=0.1, tau=1)
    impacts = tuple(ImpactDiagram(WALLS, size, follow, "d", values, wall, speed) for follow in ("down", "up") for size in sizes)
    switches = np.array([[0, 3], [4, 0]])
    stays = tuple(Residence(("one", "two"), 6, np.array([50.0, 10.0]), 1.0, switches * k) for k in range(2))
    return NoiseResult(sizes, stays, ({}, {}), impacts)


def told(stored: StudyResult, composite: CompositeMap) -> PartitionResult:
    """The stored partition as if it had made these pieces: four rows of a log, of which two are of R1 and R2."""
    made = stored.partition
    assert made is not None
    became = {"R1.0": "split along v", "R1.1": "accepted", "R2.3": "accepted: right", "R3.1": "given up: small"}
    rows = tuple(replace(made.log[0], name=name, became=text) for name, text in became.items())
    return replace(made, composite=composite, attracting=("R1",), log=rows)


def panel(drawn: Any, result: StudyResult, ax: Axes, **options: Any) -> Any:
    """A panel of a figure of the catalogue on axes, of the parts of a result that it takes."""
    name = drawn.__module__.rpartition(".")[2]
    parts = CATALOGUE[name].parts(result)
    _, *others = signature(import_module(drawn.__module__).sheets).parameters
    taken = dict(zip(others, parts[1:], strict=False))
    return drawn(parts[0], ax, **{key: part for key, part in taken.items() if key in signature(drawn).parameters}, **options)


@pytest.fixture(scope="session")
def stored() -> dict[str, StudyResult]:
    """The runs that are stored in the format of today, by the names of their folders."""
    return {
        name: read_result(STORED / name) for name in ("run", "partition", "accurate", "long", "plane", "manifolds", "resilience")
    }


@pytest.fixture(scope="session")
def result(stored: dict[str, StudyResult]) -> StudyResult:
    """Everything that a study could have computed, of the toy."""
    returns = Toy().first_return(GRID.states())
    members = {word: returns.has_word(word) for word in ("BB", "BTB")}
    surfaces = {word: Surface(word, GRID, member, returns.select(member)) for word, member in members.items()}
    pieces = (
        Piece("reset", ConditionRegion(text="phi > pi", coordinates=COORDINATES), PolyMap.reset(COORDINATES, {"phi": 1.2})),
        Piece("R1", Box.of(COORDINATES, [[0.6, 0.95], [0.1, 0.8]]), COUPLED, "BTB"),
        Piece("R2", ConditionRegion(text="v > 0.3", coordinates=COORDINATES), SEPARABLE, "BTB"),
    )
    composite = CompositeMap(COORDINATES, WALLS, pieces)
    starts = np.array([[0.35, 1.5], [0.9, 2.5]])
    domains = {
        "fitted": attracting_domain(COUPLED, [[0.6, 0.95], [0.1, 0.8]], max_updates=5, n_samples=31, of="fitted map R1"),
        "loose": attracting_domain(Toy(), [[0.9, 0.95], [0.1, 0.8]], max_updates=5, n_samples=31, of="exact map"),
    }
    study, box = study_of(), AuxiliaryRegion("A1", domains["fitted"].boxes[0], domains["fitted"].updates[0].envelopes)
    return StudyResult(
        study,
        ToyPair(**study.system_object().parameters),
        {
            "surfaces": surfaces,
            "slices": (cut(),),
            "diagonal": diagonal_region(NearDiagonal(delta=1.2), swept(surfaces["BTB"])),
            "near": compare_deltas(NearDiagonal(delta=1.2), surfaces["BTB"], [1.4], ORDERS),
            "composite": composite,
            "partition": told(stored["partition"], composite),
            "accurate": stored["accurate"].accurate,
            "speed": Speed(exact=100.0, composite=20.0),
            "orbits": tuple(OrbitPair(x, orbit(Toy(), x, 40), orbit(composite, x, 40), tracked()) for x in starts),
            "bifurcation_diagram": {
                "exact": bifurcation_diagram(_gated, "d", np.linspace(-0.1, 1, 12), [0.1, 0.5], n_returns=10, transient=0)
            },
            "observe": {"bifurcation_diagram": _observed()},
            "lyapunov": _exponents(),
            "parameter_plane": stored["plane"].parameter_plane,
            "basins": basins(Toy(), GRID, max_returns=50),
            "global_continuation": stored["resilience"].global_continuation,
            "manifolds": stored["manifolds"].manifolds,
            "noise": _noisy(),
            "domains": domains,
            "second_iterate": SecondIterate("v", None, (0.7, 0.04), (), order="min_first"),
            "auxiliary_map": auxiliary_orbit(composite, box, (), starts[0], 40),
            "branches": {"one": (continue_branch(_fixed, "d", periodic_orbit(_fixed(0.1), [0.7, 0.4]), 0.1, (0.0, 0.2)),)},
            "plane_curves": stored["plane"].plane_curves,
            **covers(),
        },
    )


def through(result: StudyResult, states: np.ndarray) -> OrbitPair:
    """The first pair of orbits with other states (m, 2) of the composite map."""
    pair = result.orbits[0]
    assert pair.composite is not None
    return replace(pair, composite=replace(pair.composite, states=states))


@pytest.fixture(autouse=True)
def dimensionless() -> Iterator[None]:
    """Labels as in figures of a system that says that it is dimensionless."""
    with drawing(units_of(Toy())):
        yield


def regions_of(result: StudyResult, ax: Axes) -> Axes:
    """The regions of a result's composite map on axes."""
    return CATALOGUE["regions"].sheets(result)[0].panels[0](ax)


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
