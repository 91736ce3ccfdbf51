"""The sections of a study, a module each, in the order in which a run computes them.

To add one, write its module and name it here; for type checkers the fields that it adds to a result stand in `Kept`.
"""

from typing import Any

from nsmaps.study.sections.base import Section
from nsmaps.study.sections.longrun.basins import BASINS
from nsmaps.study.sections.longrun.noise import NOISE
from nsmaps.study.sections.longrun.observables import OBSERVABLES
from nsmaps.study.sections.longrun.orbits import ORBITS
from nsmaps.study.sections.maps.composite import COMPOSITE
from nsmaps.study.sections.maps.diagonal import DIAGONAL
from nsmaps.study.sections.maps.parametric import PARAMETRIC
from nsmaps.study.sections.maps.partition import PARTITION
from nsmaps.study.sections.maps.second_iterate import SECOND_ITERATE
from nsmaps.study.sections.maps.slices import SLICES
from nsmaps.study.sections.maps.surfaces import FAMILIES, GRID
from nsmaps.study.sections.parameters.bifurcation import BIFURCATION
from nsmaps.study.sections.parameters.branches import BRANCHES
from nsmaps.study.sections.parameters.chart import CHART
from nsmaps.study.sections.parameters.global_continuation import GLOBAL_CONTINUATION
from nsmaps.study.sections.parameters.lyapunov import LYAPUNOV
from nsmaps.study.sections.parameters.optimum import OPTIMUM
from nsmaps.study.sections.parameters.stability import STABILITY
from nsmaps.study.sections.sets.auxiliary_map import AUXILIARY_MAP
from nsmaps.study.sections.sets.domains import DOMAINS
from nsmaps.study.sections.sets.exit_times import EXIT_TIMES
from nsmaps.study.sections.sets.horseshoe import HORSESHOE
from nsmaps.study.sections.sets.manifolds import MANIFOLDS
from nsmaps.study.sections.sets.morse import MORSE
from nsmaps.study.sections.sets.proof import PROOF

SECTIONS: tuple[Section[Any], ...] = (
    GRID,
    FAMILIES,
    SLICES,
    DIAGONAL,
    COMPOSITE,
    PARTITION,
    PARAMETRIC,
    ORBITS,
    BIFURCATION,
    BRANCHES,
    STABILITY,
    CHART,
    LYAPUNOV,
    BASINS,
    GLOBAL_CONTINUATION,
    MANIFOLDS,
    OBSERVABLES,
    OPTIMUM,
    NOISE,
    DOMAINS,
    SECOND_ITERATE,
    AUXILIARY_MAP,
    MORSE,
    EXIT_TIMES,
    PROOF,
    HORSESHOE,
)
