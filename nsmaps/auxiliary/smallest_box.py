"""The start box R1+ by search: the smallest box around a given one that a map's worst case carries into itself."""

from collections.abc import Sequence

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.auxiliary.bounds import Maker
from nsmaps.auxiliary.envelope import AnyMap
from nsmaps.auxiliary.reasons import without_image
from nsmaps.auxiliary.worst_case import is_inside
from nsmaps.progress import Work, beat

MOST_HALVED = 6  # times that a box is halved before the search ends
MOST_GROWN = 400  # times that a box is joined with its image
TRIFLE = 1e-5  # of its side, by which a growing box exceeds its image


def found_box(
    make: Maker, return_map: AnyMap, start: Floats, around: ArrayLike | None, max_growth: float, work: Work
) -> tuple[Floats | None, str]:
    """The smallest box around a given one that a map carries into itself, with auxiliary maps from `make`; or None, and why.

    Where the given box cannot be grown, half of it is tried about the state `around`, shape (n,), and half of that, and so on.
    """
    shrunk = start
    found, why = first = _grown(make, return_map, start, start, max_growth, work)
    for halves in range(1, MOST_HALVED + 1):
        if found is not None or around is None or work.over:
            break
        shrunk = (shrunk + np.asarray(around, float)[:, None]) / 2
        found, why = _grown(make, return_map, shrunk, start, max_growth, work)
        why += f" from a box halved {halves} times about the state nearest to the diagonals"
    if work.over and found is None:
        return None, why
    return (found, why) if found is not None or around is None else (None, f"{first[1]}; nor halved {MOST_HALVED} times")


def _grown(
    make: Maker, return_map: AnyMap, start: Floats, reference: Floats, max_growth: float, work: Work
) -> tuple[Floats | None, str]:
    """The start joined with its image until that lies in it, or a side exceeds `max_growth` times the reference box's."""
    grown, names = start.copy(), return_map.coordinates
    for step in range(MOST_GROWN):
        if work.over:
            return None, f"stopped after {work.max_seconds:g} s: grown {step} times to {text(names, grown)}"
        beat(0.0, f"the start box grows, step {step + 1} of at most {MOST_GROWN}")
        maps = make(grown)
        image, size = maps.worst(grown).bounds, np.ptp(grown, axis=1)
        if not np.isfinite(image).all():
            return None, f"grown {step} times to {text(names, grown)}: {without_image(return_map, grown, maps.status)}"
        if is_inside(image, grown):
            return grown, f"grown {step} times"
        below, above = image[:, 0] < grown[:, 0], image[:, 1] > grown[:, 1]
        grown[below, 0] = (image[:, 0] - TRIFLE * size)[below]
        grown[above, 1] = (image[:, 1] + TRIFLE * size)[above]
        if (np.ptp(grown, axis=1) > max_growth * np.ptp(reference, axis=1)).any():
            break
    return None, f"no useful box: {text(names, start)} grows under its own image to {text(names, grown)} and further"


def text(names: Sequence[str], box: Floats) -> str:
    """A box as intervals by name."""
    return " x ".join(f"{name} in [{low:.4g}, {high:.4g}]" for name, (low, high) in zip(names, box, strict=True))
