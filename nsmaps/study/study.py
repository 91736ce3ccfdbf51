"""The grammar of a study's file: a frozen model whose keys are the analyses; an unknown key is an error."""

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, create_model

from nsmaps.errors import NsmapsError, near_match
from nsmaps.plugins import ANALYSIS, class_of
from nsmaps.study.pictures.catalogue import figures_of
from nsmaps.study.reading.head import Head
from nsmaps.study.sections.base import Analysis, Steps
from nsmaps.study.sections.longrun.basins import BasinsSection
from nsmaps.study.sections.longrun.noise import NoiseSection
from nsmaps.study.sections.longrun.observables import ObservablesSection
from nsmaps.study.sections.longrun.orbits import Orbits
from nsmaps.study.sections.maps.composite import Pieces
from nsmaps.study.sections.maps.diagonal import DiagonalSection
from nsmaps.study.sections.maps.parametric import ParametricSection
from nsmaps.study.sections.maps.partition import PartitionSection
from nsmaps.study.sections.maps.second_iterate import SecondIterateSection
from nsmaps.study.sections.maps.slices import Slices
from nsmaps.study.sections.maps.surfaces import Families, Spans
from nsmaps.study.sections.own_name import OwnName, may_be_renamed, renamed
from nsmaps.study.sections.parameters.basin_distance import BasinDistanceSection
from nsmaps.study.sections.parameters.bifurcation import BifurcationSection
from nsmaps.study.sections.parameters.branches import Branches
from nsmaps.study.sections.parameters.estimate import EstimateSection
from nsmaps.study.sections.parameters.global_continuation import GlobalContinuationSection
from nsmaps.study.sections.parameters.lyapunov import LyapunovSection
from nsmaps.study.sections.parameters.optimum import OptimumSection
from nsmaps.study.sections.parameters.parameter_plane import ParameterPlaneSection
from nsmaps.study.sections.sets.auxiliary_map import AuxiliaryMapSection
from nsmaps.study.sections.sets.domains import Domains
from nsmaps.study.sections.sets.exit_times import ExitTimesSection
from nsmaps.study.sections.sets.horseshoe import HorseshoeSection
from nsmaps.study.sections.sets.manifolds import Manifolds
from nsmaps.study.sections.sets.morse import MorseSection
from nsmaps.study.sections.sets.proof import ProofSection


class Analyses(Head):
    """The analyses of a study by the keys of their sections, in the order of a run."""

    grid: Spans | None = None
    families: Families = Families()
    slices: Slices = Slices()
    diagonal: DiagonalSection | None = None
    composite: Pieces = Pieces()
    partition: PartitionSection | None = None
    parametric_map: ParametricSection | None = None
    orbits: Orbits = Orbits()
    bifurcation_diagram: BifurcationSection | None = None
    branches: Branches = Branches()
    parameter_plane: ParameterPlaneSection | None = None
    lyapunov: LyapunovSection | None = None
    basins: BasinsSection | None = None
    global_continuation: GlobalContinuationSection | None = None
    manifolds: Manifolds = Manifolds()
    observe: ObservablesSection | None = None
    optimize: OptimumSection | None = None
    estimate: EstimateSection | None = None
    basin_distance: BasinDistanceSection | None = None
    noise: NoiseSection | None = None
    domains: Domains = Domains()
    second_iterate: SecondIterateSection | None = None
    auxiliary_map: AuxiliaryMapSection | None = None
    morse_sets: MorseSection | None = None
    exit_times: ExitTimesSection | None = None
    proof: ProofSection | None = None
    horseshoe: HorseshoeSection | None = None

    @classmethod
    def kinds(cls) -> dict[str, type[Steps]]:
        """The classes of the analyses by the keys of their sections, in the order of a run."""
        return _kinds(cls)


@cache
def _kinds(cls: type[Analyses]) -> dict[str, type[Steps]]:
    """The analyses among the fields of a study, by key."""
    found = {}
    for key, each in cls.model_fields.items():
        candidates = (each.annotation, *getattr(each.annotation, "__args__", ()))
        kind = next((kind for kind in candidates if isinstance(kind, type) and issubclass(kind, Steps)), None)
        if kind is not None:
            found[key] = kind
    return found


CATALOGUE = figures_of(Analyses.kinds())  #: the figures of all studies, by name
if TYPE_CHECKING:
    FigureName = str
else:
    FigureName = Literal[tuple(CATALOGUE)]


class Study(Analyses):
    """One study: a system by name, its parameters, and the analyses that are to be computed, in the order of a run.

    It holds the system's name, not the system, so that it can be written to a file and read again.
    """

    figures: tuple[FigureName, ...] = Field((), description="the figures to draw; the first stands at the head of the report")
    require: tuple[Literal["covered", "tolerance"], ...] = Field(
        (),
        description="`covered`: the composite map holds every state of the grid; `tolerance`: the partition meets its tolerance",
    )
    expected_failures: dict[str, str] = Field(
        default_factory=dict,
        description="{verdict: what its failure shows}, of verdicts that are not required, at the study's own parameters",
    )

    @classmethod
    def others(cls) -> dict[str, type[Steps]]:
        """The analyses of other packages or files among them."""
        found = cls.kinds().items()
        return {key: kind for key, kind in found if key not in Analyses.model_fields and not issubclass(kind, OwnName)}

    @classmethod
    def parts_of_result(cls) -> dict[str, Any]:
        """What a result has without them: the parts of all analyses, by name, with their values where none was computed."""
        return _parts(cls)

    def stored_parts(self) -> list[str]:
        """The names of the parts of a result that are written to files."""
        return [name for kind in self.kinds().values() if kind.stored for name in kind.results]

    def without(self, *keys: str) -> "Study":
        """The study without some of its sections, figures or requirements; NsmapsError for a key that it cannot be without."""
        fields = type(self).model_fields
        for key in keys:
            if key not in fields or fields[key].is_required():
                raise NsmapsError(f"a study has no section {key!r} that can be left out{near_match(key, fields)}")
        return self.model_copy(update={key: fields[key].get_default(call_default_factory=True) for key in keys})

    def analyses(self) -> dict[str, Steps]:
        """The analyses that the study names, by key, in the order of a run."""
        return {key: getattr(self, key) for key in self.kinds() if self.names(key)}


@cache
def _parts(cls: type[Study]) -> dict[str, Any]:
    """The parts of a result of a study, by name."""
    return {name: empty for kind in cls.kinds().values() for name, empty in kind.results.items()}


@cache
def _named_analysis(key: str, name: str, cls: type[Analysis]) -> type[Analysis]:
    """The class of an analysis of another package or file under the key of its section, which names it unless the key does."""
    fields: Any = {} if key == name else {"analysis": (Literal[name], ...)}
    kind: type[Analysis] = create_model(cls.__name__, __base__=cls, __module__=cls.__module__, __doc__=cls.__doc__, **fields)
    kind.key, kind.results = key, cls.results or {key: None}
    return kind


_renamed = cache(renamed)


def analysis_of(key: str, name: str) -> type[Analysis]:
    """The analysis of this name, one of nsmaps or as `nsmaps.plugins.class_of`, under the key of a section; errors as there."""
    ours: Any = Analyses.kinds().get(name)
    if ours is not None and may_be_renamed(ours):
        return _renamed(key, ours)
    cls: Any = class_of(ANALYSIS, name)
    return _named_analysis(key, name, cls)


@cache
def _study_with(others: tuple[tuple[str, type[Steps]], ...]) -> type[Study]:
    fields: Any = {key: (kind | None, None) for key, kind in others}
    figure: Any = Literal[tuple(figures_of({**Analyses.kinds(), **dict(others)}))]
    fields["figures"] = (tuple[figure, ...], ())
    return create_model("Study", __base__=Study, __module__=__name__, __doc__=Study.__doc__, **fields)


def study_with(others: Mapping[str, type[Steps]]) -> type[Study]:
    """The grammar of studies that name analyses of other packages or files, too, by key; the same class for the same analyses."""
    return _study_with(tuple(others.items())) if others else Study


def name_of(path: Path) -> str:
    """The name of a study without the key `name`: its file's stem, without characters that are not valid in a folder's name."""
    return re.sub(r"[^\w.+-]+", "_", path.stem).lstrip(".+-") or "study"
