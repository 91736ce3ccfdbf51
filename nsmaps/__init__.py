"""Global analysis of non-smooth dynamics: return maps of systems with impacts, their surrogates and attracting domains.

Each public name is imported when it is first used, so that `import nsmaps` takes little time.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain as AttractingDomain
    from nsmaps.auxiliary.attracting_domain import attracting_domain as attracting_domain
    from nsmaps.auxiliary.bounds import envelopes as envelopes
    from nsmaps.auxiliary.envelope import Envelope as Envelope
    from nsmaps.auxiliary.full_map import FullAuxiliaryMap as FullAuxiliaryMap
    from nsmaps.cells.conley import MorseGraph as MorseGraph
    from nsmaps.cells.conley import conley_indices as conley_indices
    from nsmaps.cells.exit_times import ExitTimes as ExitTimes
    from nsmaps.cells.exit_times import exit_times as exit_times
    from nsmaps.cells.morse_sets import ForwardInvariantSet as ForwardInvariantSet
    from nsmaps.cells.morse_sets import MorseCover as MorseCover
    from nsmaps.cells.morse_sets import forward_invariant_box as forward_invariant_box
    from nsmaps.cells.morse_sets import forward_invariant_set as forward_invariant_set
    from nsmaps.cells.morse_sets import morse_sets as morse_sets
    from nsmaps.cells.periodic_points import CycleSearch as CycleSearch
    from nsmaps.cells.periodic_points import find_cycles as find_cycles
    from nsmaps.coordinates import Angle as Angle
    from nsmaps.coordinates import Coordinates as Coordinates
    from nsmaps.dynamics.attractors.attractor import Attractor as Attractor
    from nsmaps.dynamics.attractors.basins import BasinBoundary as BasinBoundary
    from nsmaps.dynamics.attractors.basins import Basins as Basins
    from nsmaps.dynamics.attractors.basins import basin_boundary as basin_boundary
    from nsmaps.dynamics.attractors.basins import basins as basins
    from nsmaps.dynamics.attractors.coexistence import match_attractors as match_attractors
    from nsmaps.dynamics.attractors.continued import GlobalContinuation as GlobalContinuation
    from nsmaps.dynamics.attractors.distance import hausdorff as hausdorff
    from nsmaps.dynamics.attractors.global_continuation import global_continuation as global_continuation
    from nsmaps.dynamics.charts.chart import ParameterPlane as ParameterPlane
    from nsmaps.dynamics.charts.chart import parameter_plane as parameter_plane
    from nsmaps.dynamics.chatter.cascade import ChatterScaling as ChatterScaling
    from nsmaps.dynamics.chatter.cascade import IncompleteChatter as IncompleteChatter
    from nsmaps.dynamics.chatter.cascade import chatter_cascade as chatter_cascade
    from nsmaps.dynamics.chatter.cascade import chatter_scaling as chatter_scaling
    from nsmaps.dynamics.chatter.complete import CompleteChatter as CompleteChatter
    from nsmaps.dynamics.continuation.branch import Branch as Branch
    from nsmaps.dynamics.continuation.events import BifurcationPoint as BifurcationPoint
    from nsmaps.dynamics.continuation.follow import continue_branch as continue_branch
    from nsmaps.dynamics.continuation.follow import period_doubling_cascade as period_doubling_cascade
    from nsmaps.dynamics.continuation.follow import switch_branch as switch_branch
    from nsmaps.dynamics.curves.curve import BifurcationCurve as BifurcationCurve
    from nsmaps.dynamics.curves.curve import bifurcation_curve as bifurcation_curve
    from nsmaps.dynamics.design.optimum import Optimum as Optimum
    from nsmaps.dynamics.design.optimum import optimize as optimize
    from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram as bifurcation_diagram
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram as BifurcationDiagram
    from nsmaps.dynamics.diagrams.stability import StabilityDiagram as StabilityDiagram
    from nsmaps.dynamics.diagrams.stability import stability_diagram as stability_diagram
    from nsmaps.dynamics.iterated import IteratedMap as IteratedMap
    from nsmaps.dynamics.lyapunov import Lyapunov as Lyapunov
    from nsmaps.dynamics.lyapunov import LyapunovSweep as LyapunovSweep
    from nsmaps.dynamics.lyapunov import lyapunov as lyapunov
    from nsmaps.dynamics.lyapunov import lyapunov_sweep as lyapunov_sweep
    from nsmaps.dynamics.manifolds.manifold import Manifold as Manifold
    from nsmaps.dynamics.manifolds.manifold import manifold as manifold
    from nsmaps.dynamics.noise.law import Noise as Noise
    from nsmaps.dynamics.noise.orbits import noisy_orbits as noisy_orbits
    from nsmaps.dynamics.observables.attractors import observe_attractors as observe_attractors
    from nsmaps.dynamics.observables.attractors import observe_diagram as observe_diagram
    from nsmaps.dynamics.observables.attractors import observe_noisy as observe_noisy
    from nsmaps.dynamics.observables.cycles import observe_branch as observe_branch
    from nsmaps.dynamics.observables.cycles import observe_orbit as observe_orbit
    from nsmaps.dynamics.observables.observe import Observed as Observed
    from nsmaps.dynamics.observables.observe import observe as observe
    from nsmaps.dynamics.orbit import Orbit as Orbit
    from nsmaps.dynamics.orbit import orbit as orbit
    from nsmaps.dynamics.periodic import PeriodicOrbit as PeriodicOrbit
    from nsmaps.dynamics.periodic import periodic_orbit as periodic_orbit
    from nsmaps.dynamics.rotation.number import RotationNumber as RotationNumber
    from nsmaps.dynamics.rotation.number import rotation_number as rotation_number
    from nsmaps.dynamics.rotation.staircase import Plateau as Plateau
    from nsmaps.dynamics.rotation.staircase import Staircase as Staircase
    from nsmaps.dynamics.rotation.staircase import staircase as staircase
    from nsmaps.dynamics.search import periodic_orbits as periodic_orbits
    from nsmaps.dynamics.search import periodic_orbits_by_word as periodic_orbits_by_word
    from nsmaps.enclosures.box_images import box_map as box_map
    from nsmaps.errors import NsmapsError as NsmapsError
    from nsmaps.exact.batches import return_batch as return_batch
    from nsmaps.exact.observables.spec import Observable as Observable
    from nsmaps.exact.outcome import Outcome as Outcome
    from nsmaps.exact.returnmap import ReturnMap as ReturnMap
    from nsmaps.exact.returns import Returns as Returns
    from nsmaps.exact.surfaces.along import Along as Along
    from nsmaps.exact.surfaces.family import ReturnFamily as ReturnFamily
    from nsmaps.exact.surfaces.family import WordFamily as WordFamily
    from nsmaps.exact.surfaces.surface import Axis as Axis
    from nsmaps.exact.surfaces.surface import Grid as Grid
    from nsmaps.exact.surfaces.surface import Surface as Surface
    from nsmaps.exact.surfaces.sweep import surfaces as surfaces
    from nsmaps.exact.systems.hybrid import Guard as Guard
    from nsmaps.exact.systems.hybrid import HybridSystem as HybridSystem
    from nsmaps.exact.systems.hybrid import PoincareSection as PoincareSection
    from nsmaps.exact.systems.hybrid import SlidingSurface as SlidingSurface
    from nsmaps.exact.systems.parameters import System as System
    from nsmaps.exact.systems.piecewise import PiecewiseMap as PiecewiseMap
    from nsmaps.exact.systems.system import ImpactSystem as ImpactSystem
    from nsmaps.exact.systems.walls import Wall as Wall
    from nsmaps.exact.trajectory import track as track
    from nsmaps.exports.document import load_map as load_map
    from nsmaps.exports.write import export as export
    from nsmaps.interrupts import Interrupted as Interrupted
    from nsmaps.parallel import Jobs as Jobs
    from nsmaps.plugins import load_system as load_system
    from nsmaps.plugins import systems as systems
    from nsmaps.proof.cycles import certificate_of as certificate_of
    from nsmaps.reduced.adaptive.surrogate import StripMap as StripMap
    from nsmaps.reduced.adaptive.surrogate import strip_map as strip_map
    from nsmaps.reduced.composite.composite import CompositeMap as CompositeMap
    from nsmaps.reduced.composite.composite import Coverage as Coverage
    from nsmaps.reduced.composite.composite import Piece as Piece
    from nsmaps.reduced.composite.composite import PieceSpec as PieceSpec
    from nsmaps.reduced.composite.composite import build_composite as build_composite
    from nsmaps.reduced.composite.parametric import ParametricMap as ParametricMap
    from nsmaps.reduced.composite.parametric import chebyshev_nodes as chebyshev_nodes
    from nsmaps.reduced.composite.parametric import parametric_map as parametric_map
    from nsmaps.reduced.composite.printed import TabulatedMap as TabulatedMap
    from nsmaps.reduced.conditions.region import Box as Box
    from nsmaps.reduced.conditions.region import ConditionRegion as ConditionRegion
    from nsmaps.reduced.conditions.region import Region as Region
    from nsmaps.reduced.fit.basis import BasisFit as BasisFit
    from nsmaps.reduced.fit.basis import Fourier as Fourier
    from nsmaps.reduced.fit.filter import DiagonalRegion as DiagonalRegion
    from nsmaps.reduced.fit.filter import NearDiagonal as NearDiagonal
    from nsmaps.reduced.fit.filter import diagonal_region as diagonal_region
    from nsmaps.reduced.fit.polyfit import PolyFit as PolyFit
    from nsmaps.reduced.fit.polyfit import PolynomialFit as PolynomialFit
    from nsmaps.reduced.fit.polyfit import SeparableFit as SeparableFit
    from nsmaps.reduced.fit.polyfit import compare_orders as compare_orders
    from nsmaps.reduced.fit.polymap import FitReport as FitReport
    from nsmaps.reduced.fit.polymap import PolyMap as PolyMap
    from nsmaps.reduced.partition.partition import partition as partition
    from nsmaps.reduced.partition.result import PartitionResult as PartitionResult
    from nsmaps.reduced.partition.spec import Partition as Partition
    from nsmaps.results import Result as Result
    from nsmaps.results import array as array
    from nsmaps.results import array_property as array_property
    from nsmaps.study.reading.reader import load_study as load_study
    from nsmaps.study.result import StudyResult as StudyResult
    from nsmaps.study.result import Verdict as Verdict
    from nsmaps.study.run import run as run
    from nsmaps.study.sections.base import Analysis as Analysis
    from nsmaps.study.sections.base import Table as Table
    from nsmaps.study.store.archive import read_result as read_result
    from nsmaps.study.study import Study as Study
    from nsmaps.symbolic.curve_iterates import HeldIterate as HeldIterate
    from nsmaps.symbolic.curve_iterates import SecondIterate as SecondIterate
    from nsmaps.symbolic.curve_iterates import held_iterate as held_iterate
    from nsmaps.symbolic.curve_iterates import second_iterate as second_iterate
    from nsmaps.symbolic.kneading import topological_entropy as topological_entropy
    from nsmaps.symbolic.map_iterates import ClosedMap as ClosedMap
    from nsmaps.symbolic.map_iterates import compose_pieces as compose_pieces
    from nsmaps.symbolic.map_iterates import symbolic_iterate as symbolic_iterate
    from nsmaps.symbolic.two_cycles import CurveCycles as CurveCycles
    from nsmaps.symbolic.two_cycles import TwoCycles as TwoCycles
    from nsmaps.symbolic.two_cycles import curve_cycles as curve_cycles
    from nsmaps.symbolic.two_cycles import two_cycles as two_cycles
    from nsmaps.verify.certificate import write_certificate as write_certificate

_PUBLIC = {
    "symbolic.map_iterates": ("ClosedMap", "compose_pieces", "symbolic_iterate"),
    "cells.conley": ("MorseGraph", "conley_indices"),
    "cells.morse_sets": ("ForwardInvariantSet", "MorseCover", "forward_invariant_box", "forward_invariant_set", "morse_sets"),
    "symbolic.two_cycles": ("CurveCycles", "TwoCycles", "curve_cycles", "two_cycles"),
    "auxiliary.attracting_domain": ("AttractingDomain", "attracting_domain"),
    "enclosures.box_images": ("box_map",),
    "auxiliary.full_map": ("FullAuxiliaryMap",),
    "symbolic.curve_iterates": ("HeldIterate", "SecondIterate", "held_iterate", "second_iterate"),
    "cells.periodic_points": ("CycleSearch", "find_cycles"),
    "cells.exit_times": ("ExitTimes", "exit_times"),
    "dynamics.attractors.basins": ("BasinBoundary", "Basins", "basin_boundary", "basins"),
    "dynamics.design.optimum": ("Optimum", "optimize"),
    "dynamics.diagrams.bifurcation": ("bifurcation_diagram",),
    "dynamics.diagrams.diagram": ("BifurcationDiagram",),
    "dynamics.attractors.attractor": ("Attractor",),
    "dynamics.chatter.cascade": ("ChatterScaling", "IncompleteChatter", "chatter_cascade", "chatter_scaling"),
    "dynamics.chatter.complete": ("CompleteChatter",),
    "dynamics.continuation.events": ("BifurcationPoint",),
    "dynamics.continuation.follow": ("continue_branch", "period_doubling_cascade", "switch_branch"),
    "dynamics.attractors.coexistence": ("match_attractors",),
    "dynamics.attractors.continued": ("GlobalContinuation",),
    "dynamics.attractors.distance": ("hausdorff",),
    "dynamics.attractors.global_continuation": ("global_continuation",),
    "dynamics.iterated": ("IteratedMap",),
    "dynamics.lyapunov": ("lyapunov_sweep", "Lyapunov", "LyapunovSweep", "lyapunov"),
    "dynamics.curves.curve": ("BifurcationCurve", "bifurcation_curve"),
    "dynamics.manifolds.manifold": ("Manifold", "manifold"),
    "dynamics.noise.law": ("Noise",),
    "dynamics.noise.orbits": ("noisy_orbits",),
    "dynamics.observables.attractors": ("observe_attractors", "observe_diagram", "observe_noisy"),
    "dynamics.observables.cycles": ("observe_branch", "observe_orbit"),
    "dynamics.observables.observe": ("Observed", "observe"),
    "dynamics.orbit": ("Orbit", "orbit"),
    "dynamics.periodic": ("PeriodicOrbit", "periodic_orbit"),
    "dynamics.rotation.number": ("RotationNumber", "rotation_number"),
    "dynamics.rotation.staircase": ("Plateau", "Staircase", "staircase"),
    "dynamics.search": ("periodic_orbits", "periodic_orbits_by_word"),
    "dynamics.diagrams.stability": ("StabilityDiagram", "stability_diagram"),
    "dynamics.charts.chart": ("ParameterPlane", "parameter_plane"),
    "dynamics.continuation.branch": ("Branch",),
    "errors": ("NsmapsError",),
    "exact.surfaces.family": ("ReturnFamily", "WordFamily"),
    "coordinates": ("Angle", "Coordinates"),
    "exact.observables.spec": ("Observable",),
    "exact.batches": ("return_batch",),
    "exact.outcome": ("Outcome",),
    "exact.returnmap": ("ReturnMap",),
    "exact.returns": ("Returns",),
    "exact.surfaces.along": ("Along",),
    "exact.surfaces.surface": ("Axis", "Grid", "Surface"),
    "exact.systems.hybrid": ("Guard", "HybridSystem", "PoincareSection", "SlidingSurface"),
    "exact.systems.parameters": ("System",),
    "exact.systems.piecewise": ("PiecewiseMap",),
    "exact.systems.system": ("ImpactSystem",),
    "exact.systems.walls": ("Wall",),
    "exports.document": ("load_map",),
    "exports.write": ("export",),
    "interrupts": ("Interrupted",),
    "parallel": ("Jobs",),
    "plugins": ("load_system", "systems"),
    "reduced.composite.composite": ("CompositeMap", "Piece", "Coverage", "PieceSpec", "build_composite"),
    "reduced.fit.filter": ("NearDiagonal", "DiagonalRegion", "diagonal_region"),
    "reduced.composite.parametric": ("ParametricMap", "parametric_map", "chebyshev_nodes"),
    "reduced.partition.partition": ("partition",),
    "reduced.partition.result": ("PartitionResult",),
    "reduced.partition.spec": ("Partition",),
    "reduced.fit.basis": ("BasisFit", "Fourier"),
    "reduced.fit.polyfit": ("PolynomialFit", "PolyFit", "SeparableFit", "compare_orders"),
    "reduced.fit.polymap": ("PolyMap", "FitReport"),
    "reduced.composite.printed": ("TabulatedMap",),
    "reduced.conditions.region": ("Box", "Region", "ConditionRegion"),
    "reduced.adaptive.surrogate": ("StripMap", "strip_map"),
    "auxiliary.bounds": ("envelopes",),
    "auxiliary.envelope": ("Envelope",),
    "exact.surfaces.sweep": ("surfaces",),
    "exact.trajectory": ("track",),
    "proof.cycles": ("certificate_of",),
    "verify.certificate": ("write_certificate",),
    "symbolic.kneading": ("topological_entropy",),
    "study.store.archive": ("read_result",),
    "study.reading.reader": ("load_study",),
    "study.run": ("run",),
    "study.sections.base": ("Analysis", "Table"),
    "study.result": ("StudyResult", "Verdict"),
    "results": ("Result", "array", "array_property"),
    "study.study": ("Study",),
}
_HOME = {name: f"nsmaps.{module}" for module, names in _PUBLIC.items() for name in names}
__all__ = sorted([*_HOME, "__version__", "show_versions"])


def __getattr__(name: str) -> Any:
    """A public name, imported from its module when it is first used."""
    if name == "__version__":
        return _version()
    if name not in _HOME:
        from nsmaps.errors import near_match

        raise AttributeError(f"module 'nsmaps' has no attribute {name!r}{near_match(name, __all__)}")
    return getattr(import_module(_HOME[name]), name)


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("nsmaps")
    except PackageNotFoundError:  # a source tree on the path that is not installed
        return "0+unknown"


def __dir__() -> list[str]:
    """The public names."""
    return list(__all__)


def show_versions() -> None:
    """Print the versions of Python, nsmaps, its required and optional packages, and the platform, for a report of an error."""
    from nsmaps.report.environment import environment

    for name, version in environment().items():
        print(f"{name:16s} {version}")
