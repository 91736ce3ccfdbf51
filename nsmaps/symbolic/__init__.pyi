"""Closed forms: exact polynomial formulas, iterates of curves and maps, two-cycles."""

from nsmaps.symbolic.curve_iterates import HeldIterate as HeldIterate
from nsmaps.symbolic.curve_iterates import SecondIterate as SecondIterate
from nsmaps.symbolic.curve_iterates import second_iterate as second_iterate
from nsmaps.symbolic.cycles import CurveCycles as CurveCycles
from nsmaps.symbolic.cycles import TwoCycles as TwoCycles
from nsmaps.symbolic.cycles import curve_cycles as curve_cycles
from nsmaps.symbolic.cycles import two_cycles as two_cycles
from nsmaps.symbolic.kneading import topological_entropy as topological_entropy
from nsmaps.symbolic.map_iterates import ClosedMap as ClosedMap
from nsmaps.symbolic.map_iterates import compose_pieces as compose_pieces
from nsmaps.symbolic.map_iterates import symbolic_iterate as symbolic_iterate
