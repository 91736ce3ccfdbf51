"""The sections of a study, a module each, in the order in which a run computes them.

To add one, write its module and name it here: in SECTIONS and, for type checkers, in Kept if it adds fields to a result.
"""

from typing import TYPE_CHECKING, Any

from nsmaps.study.sections.base import Section
from nsmaps.study.sections.basins import BASINS
from nsmaps.study.sections.bifurcation import BIFURCATION
from nsmaps.study.sections.branches import BRANCHES
from nsmaps.study.sections.composite import COMPOSITE
from nsmaps.study.sections.diagonal import DIAGONAL
from nsmaps.study.sections.domains import DOMAINS
from nsmaps.study.sections.exit_times import EXIT_TIMES
from nsmaps.study.sections.lyapunov import LYAPUNOV
from nsmaps.study.sections.morse import MORSE
from nsmaps.study.sections.noise import NOISE
from nsmaps.study.sections.orbits import ORBITS
from nsmaps.study.sections.parametric import PARAMETRIC
from nsmaps.study.sections.partition import PARTITION
from nsmaps.study.sections.second_iterate import SECOND_ITERATE
from nsmaps.study.sections.slices import SLICES
from nsmaps.study.sections.stability import STABILITY
from nsmaps.study.sections.surfaces import FAMILIES, GRID

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
    LYAPUNOV,
    BASINS,
    NOISE,
    DOMAINS,
    SECOND_ITERATE,
    MORSE,
    EXIT_TIMES,
)

if TYPE_CHECKING:
    from nsmaps.study import sections as of

    class Kept(
        of.surfaces.Stored,
        of.slices.Stored,
        of.diagonal.Stored,
        of.composite.Stored,
        of.partition.Stored,
        of.parametric.Stored,
        of.orbits.Stored,
        of.bifurcation.Stored,
        of.branches.Stored,
        of.stability.Stored,
        of.lyapunov.Stored,
        of.basins.Stored,
        of.noise.Stored,
        of.domains.Stored,
        of.exit_times.Stored,
        of.morse.Stored,
        of.second_iterate.Again,
    ):
        """The fields that sections add to a result."""
