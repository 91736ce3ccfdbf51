"""What the physics does: systems, their flights and impacts, first returns, families and surfaces."""

from nsmaps.coordinates import Coordinates as Coordinates
from nsmaps.exact.returnmap import ReturnMap as ReturnMap
from nsmaps.exact.surfaces.along import Along as Along
from nsmaps.exact.surfaces.surface import Surface as Surface
