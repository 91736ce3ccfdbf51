"""Global analysis of non-smooth dynamics: return maps of systems with impacts, their surrogates and attracting domains.

Everything below is imported when it is first asked for, so that `import nsmaps` costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nsmaps.auxiliary.compose import ClosedMap as ClosedMap
    from nsmaps.auxiliary.compose import compose as compose
    from nsmaps.auxiliary.compose import iterate as iterate
    from nsmaps.auxiliary.conley import MorseGraph as MorseGraph
    from nsmaps.auxiliary.conley import conley_indices as conley_indices
    from nsmaps.auxiliary.cover import MorseCover as MorseCover
    from nsmaps.auxiliary.cover import Trap as Trap
    from nsmaps.auxiliary.cover import closed_box as closed_box
    from nsmaps.auxiliary.cover import morse_sets as morse_sets
    from nsmaps.auxiliary.cover import trap as trap
    from nsmaps.auxiliary.cycles import CurveCycles as CurveCycles
    from nsmaps.auxiliary.cycles import TwoCycles as TwoCycles
    from nsmaps.auxiliary.cycles import curve_cycles as curve_cycles
    from nsmaps.auxiliary.cycles import two_cycles as two_cycles
    from nsmaps.auxiliary.domain import AttractingDomain as AttractingDomain
    from nsmaps.auxiliary.domain import attracting_domain as attracting_domain
    from nsmaps.auxiliary.fittedboxes import box_map as box_map
    from nsmaps.auxiliary.fullmap import FullAuxiliaryMap as FullAuxiliaryMap
    from nsmaps.auxiliary.iterate import HeldIterate as HeldIterate
    from nsmaps.auxiliary.iterate import SecondIterate as SecondIterate
    from nsmaps.auxiliary.iterate import held_iterate as held_iterate
    from nsmaps.auxiliary.iterate import second_iterate as second_iterate
    from nsmaps.auxiliary.search import CycleSearch as CycleSearch
    from nsmaps.auxiliary.search import find_cycles as find_cycles
    from nsmaps.auxiliary.transient import Transient as Transient
    from nsmaps.auxiliary.transient import transient as transient
    from nsmaps.dynamics.basins import Basins as Basins
    from nsmaps.dynamics.basins import basins as basins
    from nsmaps.dynamics.basins import boundary as boundary
    from nsmaps.dynamics.bifurcation import Bifurcation as Bifurcation
    from nsmaps.dynamics.bifurcation import bifurcation as bifurcation
    from nsmaps.dynamics.branch import cascade as cascade
    from nsmaps.dynamics.branch import continue_branch as continue_branch
    from nsmaps.dynamics.branch import doubled_branch as doubled_branch
    from nsmaps.dynamics.coexistence import coexistence as coexistence
    from nsmaps.dynamics.distance import hausdorff as hausdorff
    from nsmaps.dynamics.iterated import Iterated as Iterated
    from nsmaps.dynamics.lyapunov import Lyapunov as Lyapunov
    from nsmaps.dynamics.lyapunov import lyapunov as lyapunov
    from nsmaps.dynamics.lyapunov import lyapunov_sweep as lyapunov_sweep
    from nsmaps.dynamics.noise import Noise as Noise
    from nsmaps.dynamics.noise import noisy_orbits as noisy_orbits
    from nsmaps.dynamics.orbit import Orbit as Orbit
    from nsmaps.dynamics.orbit import orbit as orbit
    from nsmaps.dynamics.periodic import PeriodicOrbit as PeriodicOrbit
    from nsmaps.dynamics.periodic import periodic_orbit as periodic_orbit
    from nsmaps.dynamics.returnmap import ReturnMap as ReturnMap
    from nsmaps.dynamics.search import periodic_orbits as periodic_orbits
    from nsmaps.dynamics.stability import EventCurve as EventCurve
    from nsmaps.dynamics.stability import StabilityDiagram as StabilityDiagram
    from nsmaps.dynamics.stability import event_curve as event_curve
    from nsmaps.dynamics.stability import stability_diagram as stability_diagram
    from nsmaps.dynamics.trail import Branch as Branch
    from nsmaps.errors import NsmapsError as NsmapsError
    from nsmaps.exact.family import ReturnFamily as ReturnFamily
    from nsmaps.exact.family import WordFamily as WordFamily
    from nsmaps.exact.impacts import Angle as Angle
    from nsmaps.exact.impacts import Outcome as Outcome
    from nsmaps.exact.impacts import Returns as Returns
    from nsmaps.exact.parts import Along as Along
    from nsmaps.exact.surface import Axis as Axis
    from nsmaps.exact.surface import Grid as Grid
    from nsmaps.exact.surface import Surface as Surface
    from nsmaps.exact.system import ImpactSystem as ImpactSystem
    from nsmaps.exact.system import Wall as Wall
    from nsmaps.exports.document import read_map as read_map
    from nsmaps.exports.write import export as export
    from nsmaps.plugins import load_system as load_system
    from nsmaps.plugins import systems as systems
    from nsmaps.reduced.composite import CompositeMap as CompositeMap
    from nsmaps.reduced.diagonal import Diagonal as Diagonal
    from nsmaps.reduced.parametric import ParametricMap as ParametricMap
    from nsmaps.reduced.partition import Partition as Partition
    from nsmaps.reduced.partition import partition as partition
    from nsmaps.reduced.polyfit import Full as Full
    from nsmaps.reduced.polyfit import PolyFit as PolyFit
    from nsmaps.reduced.polyfit import Separable as Separable
    from nsmaps.reduced.polymap import PolyMap as PolyMap
    from nsmaps.reduced.printed import PrintedMap as PrintedMap
    from nsmaps.reduced.region import Box as Box
    from nsmaps.reduced.region import Region as Region
    from nsmaps.reduced.region import Where as Where
    from nsmaps.reduced.strips import StripMap as StripMap
    from nsmaps.reduced.strips import strip_map as strip_map
    from nsmaps.study.archive import read_result as read_result
    from nsmaps.study.reader import load_study as load_study
    from nsmaps.study.result import StudyResult as StudyResult
    from nsmaps.study.result import Verdict as Verdict
    from nsmaps.study.run import run as run
    from nsmaps.study.spec import Study as Study

_PUBLIC = {
    "auxiliary.compose": ("ClosedMap", "compose", "iterate"),
    "auxiliary.conley": ("MorseGraph", "conley_indices"),
    "auxiliary.cover": ("MorseCover", "Trap", "closed_box", "morse_sets", "trap"),
    "auxiliary.cycles": ("CurveCycles", "TwoCycles", "curve_cycles", "two_cycles"),
    "auxiliary.domain": ("AttractingDomain", "attracting_domain"),
    "auxiliary.fittedboxes": ("box_map",),
    "auxiliary.fullmap": ("FullAuxiliaryMap",),
    "auxiliary.iterate": ("HeldIterate", "SecondIterate", "held_iterate", "second_iterate"),
    "auxiliary.search": ("CycleSearch", "find_cycles"),
    "auxiliary.transient": ("Transient", "transient"),
    "dynamics.basins": ("boundary", "Basins", "basins"),
    "dynamics.bifurcation": ("Bifurcation", "bifurcation"),
    "dynamics.branch": ("cascade", "continue_branch", "doubled_branch"),
    "dynamics.coexistence": ("coexistence",),
    "dynamics.distance": ("hausdorff",),
    "dynamics.iterated": ("Iterated",),
    "dynamics.lyapunov": ("lyapunov_sweep", "Lyapunov", "lyapunov"),
    "dynamics.noise": ("Noise", "noisy_orbits"),
    "dynamics.orbit": ("Orbit", "orbit"),
    "dynamics.periodic": ("PeriodicOrbit", "periodic_orbit"),
    "dynamics.returnmap": ("ReturnMap",),
    "dynamics.search": ("periodic_orbits",),
    "dynamics.stability": ("EventCurve", "StabilityDiagram", "event_curve", "stability_diagram"),
    "dynamics.trail": ("Branch",),
    "errors": ("NsmapsError",),
    "exact.family": ("ReturnFamily", "WordFamily"),
    "exact.impacts": ("Angle", "Outcome", "Returns"),
    "exact.parts": ("Along",),
    "exact.surface": ("Axis", "Grid", "Surface"),
    "exact.system": ("ImpactSystem", "Wall"),
    "exports.document": ("read_map",),
    "exports.write": ("export",),
    "plugins": ("load_system", "systems"),
    "reduced.composite": ("CompositeMap",),
    "reduced.diagonal": ("Diagonal",),
    "reduced.parametric": ("ParametricMap",),
    "reduced.partition": ("Partition", "partition"),
    "reduced.polyfit": ("Full", "PolyFit", "Separable"),
    "reduced.polymap": ("PolyMap",),
    "reduced.printed": ("PrintedMap",),
    "reduced.region": ("Box", "Region", "Where"),
    "reduced.strips": ("StripMap", "strip_map"),
    "study.archive": ("read_result",),
    "study.reader": ("load_study",),
    "study.result": ("StudyResult", "Verdict"),
    "study.run": ("run",),
    "study.spec": ("Study",),
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
    except PackageNotFoundError:  # a source tree on the path that nobody installed
        return "0+unknown"


def __dir__() -> list[str]:
    """The public names."""
    return list(__all__)


def show_versions() -> None:
    """Print the versions of Python, of nsmaps, of what it is built on and of what it can use, and where it runs, for a report."""
    from nsmaps.report.environment import environment

    for name, version in environment().items():
        print(f"{name:16s} {version}")
