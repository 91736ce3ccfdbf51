"""What a figure shows in this run: its numbers in a sentence or two, before the catalogue's general ones."""

from collections.abc import Callable, Mapping

from nsmaps.figures.catalogue import rows_of
from nsmaps.report import of_dynamics, of_maps
from nsmaps.results import units_of
from nsmaps.study.conclusions.texts import as_computed
from nsmaps.study.result import StudyResult

Found = Callable[[StudyResult, str], str]


_FOUND: Mapping[str, Found] = {
    "motion": of_maps.motion,
    "impacts": of_maps.motion,
    "slices": of_maps.slices,
    "words": of_maps.returns,
    "regions": of_maps.pieces,
    "surfaces": of_maps.returns,
    "projections": of_maps.family,
    "diagonal": of_maps.diagonal,
    "diagonal_surface": of_maps.near,
    "orders": of_maps.orders,
    "fit_error": of_maps.orders,
    "separable": of_maps.separable,
    "partition": of_maps.partition,
    "strips": of_maps.strips,
    "speed_error": of_maps.speed,
    "orbits": of_maps.orbits,
    "cobweb": of_maps.cobweb,
    "bifurcation": of_dynamics.bifurcation,
    "branches": of_dynamics.branches,
    "stability": of_dynamics.stability,
    "chart": of_dynamics.chart,
    "observables": of_dynamics.observables,
    "lyapunov": of_dynamics.lyapunov,
    "basins": of_dynamics.basins,
    "global_continuation": of_dynamics.global_continuation,
    "manifolds": of_dynamics.manifolds,
    "noise": of_dynamics.noise,
    "auxiliary": of_maps.domain,
    "envelopes": of_maps.domain,
    "domain_size": of_maps.sizes,
    "second_iterate": of_maps.second,
    "morse": of_dynamics.morse,
    "exit_times": of_dynamics.exit_times,
}


def caption(result: StudyResult, name: str, part: str = "") -> str:
    """The sentences below a figure: the numbers of the run, then what is drawn. `part` names one sheet, as its file does."""
    found = _FOUND[name](result, part) if name in _FOUND else ""
    text = rows_of(result.study)[name].caption
    if "" in units_of(result.system):
        text += " All quantities but angles are dimensionless."
    return as_computed(result, f"{found} {text}" if found else text)
