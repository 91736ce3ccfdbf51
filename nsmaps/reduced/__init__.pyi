"""What we put in the map's place: regions, polynomials fitted on them, the composite map."""

from nsmaps.reduced.adaptive.accurate import AccurateResult as AccurateResult
from nsmaps.reduced.adaptive.surrogate import StripMap as StripMap
from nsmaps.reduced.adaptive.surrogate import strip_map as strip_map
from nsmaps.reduced.composite.composite import Coverage as Coverage
from nsmaps.reduced.composite.composite import Piece as Piece
from nsmaps.reduced.composite.parametric import ParametricMap as ParametricMap
from nsmaps.reduced.composite.parametric import chebyshev_nodes as chebyshev_nodes
from nsmaps.reduced.composite.printed import TabulatedMap as TabulatedMap
from nsmaps.reduced.fit.basis import BasisFit as BasisFit
from nsmaps.reduced.fit.filter import DiagonalRegion as DiagonalRegion
from nsmaps.reduced.fit.polymap import FitReport as FitReport
from nsmaps.reduced.fit.polymap import PolyMap as PolyMap
from nsmaps.reduced.partition.result import PartitionResult as PartitionResult
