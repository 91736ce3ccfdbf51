"""The steps of a study's run, in order: each answers a part of the result from the parts before it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.errors import FitError, NsmapsError
from nsmaps.exact.family import WordFamily
from nsmaps.exact.impacts import LONGER
from nsmaps.exact.parts import Along
from nsmaps.exact.slices import slice_along
from nsmaps.exact.surface import Surface, surfaces, surfaces_among, sweep
from nsmaps.exact.track import track
from nsmaps.reduced.composite import CompositeMap, Piece, build_composite, data_of
from nsmaps.reduced.deltas import compare_deltas
from nsmaps.reduced.diagonal import diagonal_region
from nsmaps.reduced.misleads import misleads
from nsmaps.reduced.parametric import chebyshev_nodes, parametric_map, report_on
from nsmaps.reduced.partition import partition
from nsmaps.reduced.region import Region
from nsmaps.reduced.speed import speeds
from nsmaps.study import branchsteps, enclosed, longsteps
from nsmaps.study.domains import domain_of, near_diagonals, second_iterate_of
from nsmaps.study.plan import PiecePlan, Plan
from nsmaps.study.result import OrbitPair, StudyResult
from nsmaps.study.spec import DiagonalSection, Study

if TYPE_CHECKING:
    from nsmaps.dynamics.returnmap import ReturnMap
    from nsmaps.exact.impacts import Floats
    from nsmaps.exact.system import ImpactSystem

Parts = dict[str, Any]
Counted = Callable[[int], None]  #: called with how many units of a part are done
Step = Callable[[Plan, StudyResult], Parts]


def _system(plan: Plan, result: StudyResult) -> Parts:
    """The compiled map, made or fetched from its cache; alone, so that its time is not another step's."""
    with plan.study.source.located(("system",)):
        plan.system.first_return(np.zeros((1, len(plan.system.coordinates))))
    return {}


def _surfaces(plan: Plan, result: StudyResult) -> Parts:
    """Step i: every state's first return over the grid, and the surfaces of the families among them."""
    assert plan.grid is not None
    returns = plan.system.first_return(plan.grid.states())
    families = list(plan.families.values())
    if plan.study.partition and not families:
        words = [word for word in np.unique(returns.words[returns.valid]).tolist() if LONGER not in word]
        families = [WordFamily(name=word, words=(word,)) for word in words]
    return {"returns": returns, "surfaces": surfaces_among(plan.system, returns, plan.grid, families)}


def _slices(plan: Plan, result: StudyResult) -> Parts:
    """First returns along one coordinate, the others held: cuts through the surfaces of step i."""
    return {"slices": tuple(slice_along(plan.system, *cut) for cut in plan.slices)}


def _diagonal(plan: Plan, result: StudyResult) -> Parts:
    """Step ii: the region near the diagonals, united over a parameter, and the orders of polynomials compared.

    Orders are compared on the states near the diagonals at the study's own parameters (fig. comparert, table TableDeltaErr).
    """
    section = plan.study.diagonal
    assert section is not None
    assert plan.diagonal is not None
    with plan.study.source.located(("diagonal",)):
        region = diagonal_region(plan.diagonal, _swept(plan, section))
    own = result.surfaces[section.family]
    if plan.diagonal_grid is not None:
        own = plan.families[section.family].surface(plan.system, plan.diagonal_grid)
    with plan.study.source.located(("diagonal", "orders")):
        near = compare_deltas(plan.diagonal, own, section.deltas, plan.orders)
    orders = tuple((name, made.report) for name, made in near[0].maps.items())
    return {"diagonal": region, "near": near, "orders": orders}


def _swept(plan: Plan, section: DiagonalSection) -> list[tuple[float, Surface]]:
    """The family's surface for each value of the swept parameter."""
    grid, family = plan.diagonal_grid or plan.grid, plan.families[section.family]
    assert grid is not None
    if section.sweep is None:
        return [(float("nan"), family.surface(plan.system, grid))]
    values = np.linspace(section.sweep.low, section.sweep.high, section.sweep.points)
    swept = []
    for done, (value, found) in enumerate(sweep(plan.system, section.sweep.parameter, values, grid, [family]), 1):
        swept.append((value, found[section.family]))
        plan.told(done / section.sweep.points)
    return swept


def _composite(plan: Plan, result: StudyResult) -> Parts:
    """Steps iv to vi: every piece fitted, printed or reset."""
    composite = _made(plan, plan.system, result.surfaces)
    return {"composite": composite, **_judged(plan, result, composite)}


def _judged(plan: Plan, result: StudyResult, composite: CompositeMap) -> Parts:
    """What of the grid the pieces of a composite map hold, and where it gives another word than the exact map."""
    if plan.grid is None or result.returns is None:
        return {}
    return {"coverage": composite.coverage(plan.grid), "misleads": misleads(composite, plan.grid, result.returns)}


def _made(plan: Plan, system: "ImpactSystem", surfaces: dict[str, Surface]) -> CompositeMap:
    """The composite map at the parameters of a system; piece by piece, so that an error finds its line."""
    pieces: list[Piece] = []
    for number, piece in enumerate(plan.pieces):
        with plan.study.source.located(("composite", number)):
            pieces.append(_piece(plan, system, surfaces, piece))
    return CompositeMap(system.coordinates, system.wall_names, tuple(pieces))


def _partition(plan: Plan, result: StudyResult) -> Parts:
    """Steps ii to vii by themselves."""
    from nsmaps.reduced.accurate import accurate

    spec, grid = plan.study.partition, plan.grid
    assert grid is not None
    assert spec is not None
    with plan.study.source.located(("partition",)):
        box = np.array([(axis.low, axis.high) for axis in grid.axes.values()])
        if spec.kind == "accurate":
            strips = accurate(plan.system, grid, spec.tolerance, lambda leaves, waiting: plan.told(leaves / (leaves + waiting)))
            return {"accurate": strips, "speed": speeds(plan.system, strips.map(plan.system), box)}
        made = partition(plan.system, grid, spec, lambda pieces, most: plan.told(pieces / most))
    speed = speeds(plan.system, made.composite, box)
    return {"partition": made, "composite": made.composite, "speed": speed, **_judged(plan, result, made.composite)}


def _piece(plan: Plan, system: "ImpactSystem", surfaces: dict[str, Surface], piece: PiecePlan) -> Piece:
    """One piece, fitted to its own data where the study says so and otherwise to all that its region holds."""
    if piece.polynomial is not None:
        word = plan.families[piece.family].words[0] if piece.family else ""
        return Piece(piece.name, piece.region, piece.polynomial.of(system), word)
    surfaces, spec = _data(plan, surfaces, piece)
    made = build_composite(system.coordinates, system.wall_names, surfaces, [spec]).pieces[0]
    return replace(made, region=piece.region)


def _data(plan: Plan, surfaces: dict[str, Surface], piece: PiecePlan) -> tuple[dict[str, Surface], PiecePlan]:
    """The surfaces that a piece is fitted to, and the piece with the region of its data for its own."""
    data: Region = piece.data or piece.region
    if piece.near_diagonals:
        surfaces, data = near_diagonals(plan, surfaces[piece.family or ""])
    return surfaces, replace(piece, region=data)


def _parametric(plan: Plan, result: StudyResult) -> Parts:
    """The composite map as a function of a parameter: made from its nodes, held against refits half-way between them."""
    section = plan.study.parametric
    assert section is not None
    ends = (section.low, section.high)
    nodes = chebyshev_nodes(*ends, section.nodes or 2 * section.order + 1)
    with plan.study.source.located(("parametric",)):
        first, then = plan.part(0, 2, len(nodes)), plan.part(1, 2, len(nodes) + 1)
        at_nodes = {value: composite for value, composite, _ in _refits(plan, section.parameter, nodes, first)}
        made = parametric_map(at_nodes, section.parameter, *ends, section.order)
        held = _refits(plan, section.parameter, np.array([ends[0], *(nodes[1:] + nodes[:-1]) / 2, ends[1]]), then)
        return {"parametric": replace(made, report=report_on(made, held) if held[0][2] else None)}


@dataclass(frozen=True, slots=True, eq=False)
class _Refitted:
    """The composite map over a parameter, its pieces made at each value: a `map_of` whose parts can be kept."""

    plan: Plan
    system_at: Along

    def __call__(self, value: float) -> CompositeMap:
        return _refit(self.plan, self.system_at(value))[0]


def _refits(plan: Plan, parameter: str, values: "Floats", told: Counted) -> list[tuple[float, CompositeMap, dict[str, Surface]]]:
    """The composite map at each value of a parameter, with the exact data that its fitted pieces were fitted to."""
    made = []
    for value in values.tolist():
        try:
            made.append((value, *_refit(plan, plan.system.at(**{parameter: value}))))
        except NsmapsError as error:
            raise FitError(f"at {parameter} = {value:.6g}: {error}") from error
        told(len(made))
    return made


def _refit(plan: Plan, system: "ImpactSystem") -> tuple[CompositeMap, dict[str, Surface]]:
    """The composite map of a system with other parameters than the study's, and the data of its fitted pieces, by name."""
    found = surfaces(system, plan.grid, list(plan.families.values())) if plan.grid else {}
    composite = _made(plan, system, found)
    fitted = [(piece.name, *_data(plan, found, piece)) for piece in plan.pieces if piece.fit]
    return composite, {name: data_of(system.coordinates, own, spec) for name, own, spec in fitted}


def _orbits(plan: Plan, result: StudyResult) -> Parts:
    """The orbits of every start under the exact map and under the composite map, and what they end on."""
    from nsmaps.dynamics.ending import ending
    from nsmaps.dynamics.orbit import orbit

    pairs, count = [], 2 * len(plan.starts)
    for k, (section, start) in enumerate(zip(plan.study.orbits, plan.starts, strict=True)):
        first, then = (plan.part(half, count, section.returns) for half in (2 * k, 2 * k + 1))
        reduced = orbit(result.reduced, start, section.returns, first) if result.reduced else None
        exact = orbit(plan.system, start, section.returns, then)
        reduced_ends = ending(result.reduced, reduced) if result.reduced and reduced else None
        kept = track(plan.system, start, section.track) if section.track else None
        pairs.append(OrbitPair(start, exact, reduced, kept, ending(plan.system, exact), reduced_ends))
    return {"orbits": tuple(pairs)}


def _bifurcation(plan: Plan, result: StudyResult) -> Parts:
    """The attractors over a parameter, of the exact map and of the composite map, whose pieces are made at each value."""
    from nsmaps.dynamics.bifurcation import bifurcation

    section = plan.study.bifurcation
    assert section is not None
    assert plan.long_start is not None
    values = np.linspace(section.low, section.high, section.points)
    how = section.returns, section.transient, section.follow

    system_at = Along(plan.system, section.parameter)
    maps: dict[str, tuple[Callable[[float], ReturnMap], int | None]] = {
        "exact": (system_at, None),
        "composite": (_Refitted(plan, system_at), 1),  # a part a value: to make the map takes longer than its returns
    }
    ways = 2 if section.follow == "both" else 1
    with plan.study.source.located(("bifurcation",)):
        made = {}
        for k, of in enumerate(section.of):
            map_of, part = maps[of]
            told = plan.part(k, len(section.of), ways * section.points)
            made[of] = bifurcation(map_of, values, plan.long_start, *how, progress=told, keep=plan.kept(of), part=part)
        return {"bifurcation": made}


def _domains(plan: Plan, result: StudyResult) -> Parts:
    """The attracting domains, each of the map that the study names for it."""
    domains = {}
    for number, section in enumerate(plan.study.domains):
        with plan.study.source.located(("domains", number)):
            told = plan.part(number, len(plan.study.domains), section.updates)
            domains[section.name] = domain_of(plan, result, section, told)
    return {"domains": domains}


def _second_iterate(plan: Plan, result: StudyResult) -> Parts:
    with plan.study.source.located(("second_iterate",)):
        return {"second_iterate": second_iterate_of(result)}


STEPS: dict[str, Step] = {
    "system": _system,
    "surfaces": _surfaces,
    "slices": _slices,
    "diagonal": _diagonal,
    "composite": _composite,
    "partition": _partition,
    "parametric": _parametric,
    "orbits": _orbits,
    "bifurcation": _bifurcation,
    "branches": branchsteps.branches,
    "stability": branchsteps.stability,
    "lyapunov": longsteps.lyapunov,
    "basins": longsteps.basins,
    "noise": longsteps.noise,
    "domains": _domains,
    "second_iterate": _second_iterate,
    "morse": enclosed.morse,
    "transient": enclosed.transient,
}
SECTION = {name: "grid" if name == "surfaces" else name for name in STEPS}


def steps_of(study: Study) -> list[str]:
    """What a run of the study computes, in order."""
    return [name for name in STEPS if name == "system" or study.names(SECTION[name])]
