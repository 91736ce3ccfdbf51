"""The distance of motions from a graze: impact speeds, and gaps to what is not met, as shares of speeds of the motion."""

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import StateError
from nsmaps.exact.returnmap import ExactMap, ReturnMap
from nsmaps.exact.systems.hybrid import HybridSystem

RELEASE = 1e-30  #: clearance at the beginning of a flight at speed zero, by rounding of its phase; others have at least rounding


def speeds_of(return_map: ReturnMap, states: Floats, scale: Floats) -> Floats | None:
    """The largest speeds towards each guard or wall on the motions through states (N, n) in a scale.

    None of maps without flights, and where a state is not a start.
    """
    if not isinstance(return_map, HybridSystem):
        return scale[:1] if isinstance(return_map, ExactMap) else None
    try:
        return return_map.guard_speeds(states, between=True)
    except StateError:
        return None


def margins_of(return_map: ReturnMap, states: Floats, speeds: Floats | None) -> Floats:
    """The margins of N first returns from a graze, shape (2, N): least gap to what is not met, least impact speed.

    Speeds are shares of those of `speeds_of`, gaps shares of the distance moved at these in a radian of phase, without forcing in
    a unit of time. Infinity of maps without flights, and where a flight dips below its release by rounding.
    """
    if speeds is None or not isinstance(return_map, ExactMap):
        return np.full((2, len(states)), np.inf)
    if isinstance(return_map, HybridSystem):
        found, unit = return_map.itineraries(states, speeds), 1.0
    else:
        found, unit = return_map.itineraries(states), float(speeds[0])
    margins = np.array([found.clearance * (return_map.phase_rate() or 1.0), found.slowest]) / unit
    margins[0, (margins[0] != 0) & (np.abs(margins[0]) < RELEASE)] = np.inf
    return margins
