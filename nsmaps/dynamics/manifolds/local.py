"""The start of an invariant manifold: a curve through a saddle on which the map multiplies its parameter by a number."""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap

FARTHEST, NEAREST = 1e-2, 1e-7  #: lengths of the curve that are tried, each half of the one before
ACCURATE, WORST = 1e-11, 1e-6  #: errors of its end: at which a length is taken, and above which none is
BESIDE = 1e-2  #: distance at which derivatives are compared for the curvature, as a share of the length


@dataclass(frozen=True, slots=True, eq=False)
class Saddle:
    """A side of a manifold at a state of a saddle."""

    slope: Floats  #: shape (2,), of length one in units of the scale
    multiplier: float  #: of the returns, above 1
    returns: int  #: those of the cycle, or twice as many if these turn the side over to the other
    derivative: Floats  #: shape (2, 2), of the returns


@dataclass(frozen=True, slots=True)
class LocalCurve:
    """The curve state + slope s + bend s^2/2 for 0 <= s <= length, which n returns map to itself but for an error.

    All but the state is in units of a scale of the coordinates, in which the slope is a unit vector: s is an arclength.
    """

    coordinates: Coordinates
    scale: Floats  #: shape (2,)
    state: Floats  #: shape (2,)
    slope: Floats  #: shape (2,)
    bend: Floats  #: shape (2,)
    multiplier: float  #: of n returns, above 1
    returns: int  #: n
    length: float
    error: float  #: distance of the image of length/multiplier from the end, in units of the scale: estimates that of the curve

    def at(self, share: Floats) -> Floats:
        """The states of the last piece that n returns stretch over themselves, from share 0 to share 1; shape (N, 2)."""
        s = (self.length * self.multiplier ** (share - 1.0))[:, None]
        return self.coordinates.wrap(self.state + self.scale * (s * self.slope + s**2 / 2 * self.bend))


def local_curve(return_map: ReturnMap, state: Floats, saddle: Saddle, scale: Floats) -> LocalCurve:
    """The curve from a state of a saddle in the direction of one side.

    Its curvature is that of the manifold, by differences of exact derivatives; its length is halved until its end is mapped
    onto it to 1e-11 of the scale, or to the best that there is.

    Raises:
        NsmapsError: no curve beside the saddle is smooth: words change at it.
    """
    coordinates, returns, slope, multiplier = Coordinates(return_map.coordinates), saddle.returns, saddle.slope, saddle.multiplier
    own = saddle.derivative * scale / scale[:, None]
    _, words, _ = several(return_map, state[None], returns)
    best: LocalCurve | None = None
    length = FARTHEST
    while length > NEAREST:
        h = length * BESIDE
        ends = state + scale * slope * np.array([[h], [-h]])
        images, labels, slopes = several(return_map, coordinates.wrap(ends), returns, True)
        if (labels == words).all() and np.isfinite(images).all():
            second = (slopes[0] - slopes[1]) * scale / scale[:, None] @ slope / (2 * h)
            bend = np.linalg.solve(multiplier**2 * np.eye(2) - own, second)
            curve = LocalCurve(coordinates, scale, state, slope, bend, multiplier, returns, length, np.inf)
            image, label, _ = several(return_map, curve.at(np.zeros(1)), returns)
            gap = coordinates.difference(image, curve.at(np.ones(1))) / scale
            error = float(np.linalg.norm(gap)) if (label == words).all() else np.inf
            curve = LocalCurve(coordinates, scale, state, slope, bend, multiplier, returns, length, error)
            best = curve if best is None or error < best.error else best
            if error < ACCURATE:
                break
        length /= 2
    if best is None or not best.error <= WORST:
        raise NsmapsError(
            f"the manifold of the saddle {state.tolist()}: no curve beside it that {returns} returns map to itself, down to "
            f"{NEAREST:g} of the scale; expected: a map that is smooth there"
        )
    return best


def several(return_map: ReturnMap, states: Floats, n: int, derivative: bool = False) -> tuple[Floats, Ints, Floats]:
    """The images of states (N, 2) after n returns, the codes and outcomes on the way (N, 2 n), and the derivatives (N, 2, 2).

    A return that ends without an image, or that sticks, which makes one point of a curve, has the image NaN.
    """
    labels, product = [], np.broadcast_to(np.eye(2), (len(states), 2, 2))
    for _ in range(n):
        found = return_map.first_return(states, derivative)
        moves = found.valid & (found.outcome != Outcome.stuck)
        states = np.where(moves[:, None], found.image, np.nan)
        labels += [found.codes, np.where(moves, -1, found.outcome).astype(np.int64)]
        if found.derivative is not None:
            product = found.derivative @ product
    return states, np.column_stack(labels), product
