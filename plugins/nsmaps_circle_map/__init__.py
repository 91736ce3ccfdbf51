"""Circle maps: the sine map, a map with a plateau, and one with a gap."""

from nsmaps_circle_map.system import CircleMap, GapCircleMap, PlateauCircleMap

__all__ = ["CircleMap", "GapCircleMap", "PlateauCircleMap"]
