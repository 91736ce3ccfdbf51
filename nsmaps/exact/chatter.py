"""When impacts that accumulate are summed: the default of `chatter` of all systems, and its check."""

from nsmaps.errors import StateError

#: default of `chatter`: largest impact speed from which chatter at the section is summed, as a share of the speed that the
#: acceleration into the surface gives in a radian of the forcing, without forcing in the longest step of a mode
SUMMED_SPEED = 1e-12


def check_chatter(chatter: float) -> float:
    """The share as a float. StateError for one that is negative or NaN."""
    if not chatter >= 0:
        raise StateError(f"chatter is {chatter}; expected: a share >= 0 (0: never summed, inf: as soon as possible)")
    return float(chatter)
