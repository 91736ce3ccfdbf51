"""Why a box is not carried into itself: states without image, or a derivative whose worst case expands."""

from collections.abc import Iterator, Sequence

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.auxiliary.envelope import AnyMap, image_function
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.enclosures.box_images import box_map
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.reduced.fit.polymap import PolyMap

TRIED = 1000  #: random states of a box, in addition to its corners
STARTS = 1 / 6, 1 / 2, 5 / 6  #: of each side of a box, where orbits start that may converge to a fixed point
RETURNS = 64  #: length of these orbits


def without_image(return_map: AnyMap, box: Floats, status: str) -> str:
    """Why auxiliary maps of some status have no bounds over a box, shape (n, 2): its states without an image."""
    states = _tried(box)
    with np.errstate(all="ignore"):
        has = np.isfinite(image_function(return_map, box)(states)).all(axis=1)
    lost = states[~has]
    if len(lost):
        return (
            f"{len(lost)} of {len(states)} states tried in the box have no image, as {_assigned(return_map.coordinates, lost[0])}"
        )
    unknown = "the enclosure does not decide for all states of the box where, or whether, they have an image"
    unbounded = unknown if status == "enclosed" else "there is no bound of the images of the box"
    return f"{unbounded}; all {len(states)} states tried in it have one"


def about_fixed_point(return_map: AnyMap, box: Floats) -> str:
    """Whether worst cases contract about a stable fixed point that is found in a box, shape (n, 2); empty where there is none.

    With J the derivative there, the worst case takes a small box of sides w to one of sides |J| w: into itself for some w if
    the spectral radius of |J| is less than one (as for w = (1 - |J|)^-1 s with any s > 0), and for none if it is more.
    """
    found = [(float(np.abs(np.linalg.eigvals(np.abs(point.derivative))).max()), point) for point in _stable(return_map, box)]
    if not found:
        return ""
    radius, point = max(found, key=lambda each: each[0])
    state = Coordinates(return_map.coordinates).lift(point.states[0], box.mean(axis=1))
    where = f"its stable fixed point {_assigned(return_map.coordinates, state)}"
    criterion = f"the absolute derivatives have spectral radius {radius:.4g}"
    if radius > 1:
        no = "no small box about it is carried into itself, whatever its sides"
        return f"at {where} {criterion}, more than 1: {no}; cells are not bound to boxes: `morse_sets`"
    if radius == 1:
        return ""
    sides = np.linalg.solve(np.eye(len(box)) - np.abs(point.derivative), np.ptp(box, axis=1))
    ratio = " : ".join(f"{side:.3g}" for side in sides / sides[0])
    return f"at {where} {criterion}, less than 1: small boxes about it with sides as {ratio} are carried into themselves"


def _tried(box: Floats) -> Floats:
    """The corners of a box, and states at random."""
    corners = np.stack(np.meshgrid(*box, indexing="ij"), axis=-1).reshape(-1, len(box))
    inside = box[:, 0] + np.ptp(box, axis=1) * np.random.default_rng(0).random((TRIED, len(box)))
    return np.concatenate([corners, inside])


def _stable(return_map: AnyMap, box: Floats) -> Iterator[PeriodicOrbit]:
    """Stable fixed points in a box to which orbits from it converge, if the map has derivatives."""
    returning = box_map(return_map) if isinstance(return_map, PolyMap) else return_map
    if not isinstance(returning, ReturnMap):
        return
    side = box[:, :1] + np.ptp(box, axis=1)[:, None] * STARTS
    starts = np.stack(np.meshgrid(*side, indexing="ij"), axis=-1).reshape(-1, len(box))
    if returning.first_return(starts[:1], derivative=True).derivative is None:
        return
    with np.errstate(all="ignore"):
        final = orbit(returning, starts, RETURNS).final
    for state in final[np.isfinite(final).all(axis=1)]:
        point = periodic_orbit(returning, state)
        there = Coordinates(return_map.coordinates).lift(point.states[0], box.mean(axis=1))
        if point.converged and point.exists and point.stable and ((box[:, 0] <= there) & (there <= box[:, 1])).all():
            yield point


def _assigned(names: Sequence[str], state: Floats) -> str:
    return "(" + ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, state, strict=True)) + ")"
