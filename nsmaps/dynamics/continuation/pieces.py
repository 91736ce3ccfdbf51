"""The borders of pieces given by formulas at which branches end, located by Newton's method, and what becomes of cycles there.

A cycle is continued by the formulas of its pieces beyond their borders: its states and the parameter are the unknowns, its gaps
and a function that is zero at a border the equations. Where the map is continuous the numbers of real multipliers above 1 and
below -1 on either side decide: M. di Bernardo, M. I. Feigin, S. J. Hogan, M. E. Homer, Chaos Solitons Fractals 10 (1999) 1881.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.core import correct, length, tangent
from nsmaps.dynamics.continuation.border import GAP, NONSMOOTH_FOLD, PERSISTENCE, WITH_DOUBLING, Multipliers, counts
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint, parameter_rates
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.exact.piecewise.prolonged import Prolonged
from nsmaps.exact.returnmap import ReturnMap, letters_of
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.results import Result, array

CLOSE = 1e-3  #: distance of a state from a border, in scales of the coordinates, within which one is sought
BEYOND = 1e-7  #: a border, in these: states that show which piece is there
NEARBY = 1e-10  #: from a border at which the slope of a piece is infinite
CLOSER = 1e-2  #: share of this at which it is seen whether the map jumps: where it is continuous images meet as the square root
CONTINUOUS = 1e-9  #: difference of the images by both pieces, as a share of the scale
LEFT = 1e-6, 1e-5, 1e-4, 1e-3  #: distances beyond it, in the scale, at which the cycles of the other side are sought
AT_ONCE = 1e-9  #: distance of further states from their borders, in the scale, that are there with the first
STRAIGHT = 0.98  #: least cosine between the directions at a point and at a border ahead of it
STEPS, STALLED, ROUNDING = 20, 1e-9, 1e-15  #: of Newton's method: most, and the length from which on they are rounding


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AtBorder(Result):
    """States of a cycle at borders of their pieces, and the pieces of all q states on the cycle's side and on the other one."""

    states: tuple[int, ...]  #: numbers of these states
    borders: tuple[int, ...]  #: numbers of the functions that are zero there, see `nsmaps.exact.piecewise.prolonged.Pieces`
    signs: tuple[int, ...]  #: of these functions on the cycle's side
    own: tuple[int, ...]  #: numbers of the q pieces on the cycle's side
    other: tuple[int, ...]  #: and on the other side; -1 for none
    lowest: Floats = field(metadata=array("side point coordinate", "from which turns of angles begin on either side"))
    free: tuple[int, ...]  #: numbers of states that may lie beyond borders

    def prolonged(self, return_map: ReturnMap, *sides: int) -> Prolonged:
        """A map on cycles by the pieces of one side (0: own, 1: other), or of one after the other."""
        pieces = tuple(piece for side in sides for piece in (self.own, self.other)[side])
        free = tuple(k + len(self.own) * turn for turn in range(len(sides)) for k in self.free)
        known = PiecewiseMap.require(return_map, "pieces beyond their borders")
        return known.prolongation(pieces, np.concatenate([self.lowest[side] for side in sides]), free)

    def along(self, map_of: Callable[..., ReturnMap], *sides: int) -> Callable[..., Prolonged]:
        """As `prolonged`, over parameters; by the pieces of the cycle's side where none is given."""
        return lambda *values: self.prolonged(map_of(*values), *(sides or (0,)))

    def distance(self, return_map: ReturnMap, states: Floats) -> Floats:
        """The function that is zero at the first border, of M cycles (M, q, n), shape (M,); the map is one of `prolonged`."""
        assert isinstance(return_map, Prolonged)
        found = return_map.borders(states.reshape(-1, states.shape[-1]))[0]
        return found.reshape(*states.shape[:2], -1)[:, self.states[0], self.borders[0]]

    def equation(self, curve: OrbitCurve, point: OrbitPoint, value: float) -> tuple[float, Floats]:
        """The distance from the first border in the curve's units, and its derivatives by the unknowns, shape (q n + 1,).

        The maps of the curve are those of `prolonged`, and the value is that of its parameter.
        """
        return_map, k, j = curve.map_of(value), self.states[0], self.borders[0]
        assert isinstance(return_map, Prolonged)
        rates = parameter_rates(curve.map_of, value, curve.unit, return_map)
        values, gradients, along = return_map.borders(point.orbit.states, rates)
        row, by_state = np.zeros(len(point.y)), gradients[k, j] * curve.scale
        row[:-1].reshape(point.orbit.states.shape)[k] = by_state * np.sqrt(curve.period)
        row[-1], size = along[k, j] * curve.unit, float(np.linalg.norm(by_state))
        return float(values[k, j]) / size, row / size

    def second(self, return_map: ReturnMap, states: Floats, scale: Floats) -> str:
        """Which other state of a cycle is next to a border too, in words; "" if none is. The map is one of `prolonged`."""
        assert isinstance(return_map, Prolonged)
        values, gradients, _ = return_map.borders(states)
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.nan_to_num(np.abs(values) / np.linalg.norm(gradients * scale, axis=-1), nan=np.inf)
        off[list(self.states)] = np.inf
        k, j = np.unravel_index(int(off.argmin()), off.shape)
        return f"state {k + 1} is at {return_map.of.names[j]} too, two borders at once" if off[k, j] <= CLOSE else ""

    def beyond(self, curve: OrbitCurve, event_value: float, states: Floats, *sides: int) -> OrbitPoint | None:
        """A cycle by the pieces of the sides, one after the other, that has just left the border; None where there is none.

        Its state that was at the border, on the last of the sides, is at a small distance beyond it.
        """
        if min(self.other) < 0:
            return None
        smooth, k, j = replace(curve, map_of=self.along(curve.map_of, *sides)), self.states[0], self.borders[0]
        gradient = self.prolonged(curve.map_of(event_value), 0).borders(states)[1][k, j]
        turn = len(states) * (len(sides) - 1)
        whole, normal = np.tile(states, (len(sides), 1)), np.zeros((len(states) * len(sides), states.shape[1]))
        normal[turn + k] = -self.signs[0] * _normal(gradient, curve.scale)
        y, along = curve.y(whole, event_value), curve.y(normal, 0.0)
        for distance in LEFT:
            found = correct(smooth, y + distance * along, along / length(along))
            there = None if found is None else curve.evaluate(found.y)
            if found is not None and there is not None and curve.connects(found, there) and curve.exists(there):
                return there
        return None

    def returns(
        self, curve: OrbitCurve, return_map: ReturnMap, states: Floats, side: int, share: float = 1.0
    ) -> tuple[Returns, bool]:
        """The returns of the cycle by the pieces of a side, and whether a slope is infinite there: then those from next to it.

        They are from a share of `NEARBY` beside it.
        """
        there, beside = self.prolonged(return_map, side), states.copy()
        found = there.first_return(states, derivative=True)
        if np.isfinite(found.slopes).all():
            return found, False
        gradients = there.borders(states)[1]
        for k, j, sign in zip(self.states, self.borders, self.signs, strict=True):
            beside[k] += (sign, -sign)[side] * share * NEARBY * _normal(gradients[k, j], curve.scale)
        return there.first_return(beside, derivative=True), True

    def halves(self, curve: OrbitCurve, point: OrbitPoint) -> bool:
        """True if the cycle is one of the segment of cycles that a period doubling of affine pieces has, and ends there.

        The pieces on the other side are those of half the period, twice, with a multiplier -1.
        """
        return_map, (half, odd) = curve.map_of(point.value), divmod(len(self.other), 2)
        if odd or min(self.other) < 0 or self.other[:half] != self.other[half:] or not return_map.is_affine:
            return False
        returns, _ = self.returns(curve, return_map, point.orbit.states, 1)
        multipliers = PeriodicOrbit(returns.select(np.arange(half)), curve.tolerance, curve.scale).multipliers
        return bool(np.abs(multipliers + 1).min() <= CONTINUOUS)

    def jump(self, curve: OrbitCurve, here: Returns, there: Returns) -> float:
        """The largest difference of the images by the pieces of both sides, in the curve's scale."""
        return float(np.max(np.abs(curve.coordinates.difference(here.image, there.image)) / curve.scale))

    def outcome(self, curve: OrbitCurve, value: float, states: Floats) -> tuple[str, str]:
        """What becomes of the cycle at a value of the parameter, "" where that is not known, and the place in words."""
        return_map = curve.map_of(value)
        of = self.prolonged(return_map, 0).of
        letters = dict(enumerate(of.formulas.letters)) | {-1: "no piece"}
        place = " and ".join(
            f"state {k + 1} ({letters[self.own[k]]}) at {of.names[j]}, beyond which is {letters[self.other[k]]}"
            for k, j in zip(self.states, self.borders, strict=True)
        )
        if min(self.other) < 0:
            return "", place
        if len(states) > 1 and curve.coordinates.near(states, states[:1], AT_ONCE, curve.scale).all():
            return "", f"all {len(self.own)} states at {of.names[self.borders[0]]}: the cycle shrinks to a point"
        (here, steep), (there, beyond) = (self.returns(curve, return_map, states, side) for side in (0, 1))
        off = self.jump(curve, here, there)
        nearer = self.jump(curve, *(self.returns(curve, return_map, states, side, CLOSER)[0] for side in (0, 1)))
        if not (off <= CONTINUOUS or ((steep or beyond) and nearer <= 2 * np.sqrt(CLOSER) * off)):
            return GAP, f"{place}; the map jumps"
        own, other = (PeriodicOrbit(each, curve.tolerance, curve.scale).multipliers for each in (here, there))
        (own_above, own_below), (above, below) = counts(own), counts(other)
        kind = NONSMOOTH_FOLD if (own_above + above) % 2 else PERSISTENCE
        if steep or beyond:
            return kind, f"{place}; the slope of {letters[(self.own if steep else self.other)[self.states[0]]]} is infinite"
        if any(np.abs(np.abs(each) - 1).min() <= CONTINUOUS for each in (own, other)):
            return "", f"{place}; multipliers {_shown(own)} and {_shown(other)}, of which one is of size 1"
        return kind + WITH_DOUBLING * ((own_below + below) % 2), f"{place}; multipliers {_shown(own)} and {_shown(other)}"


def _shown(multipliers: Multipliers) -> str:
    return ", ".join(f"{value.real:.4g}" if value.imag == 0 else f"{value:.4g}" for value in multipliers)


def _normal(gradient: Floats, scale: Floats) -> Floats:
    """The direction in which a function grows fastest in a scale, of length one there."""
    return np.asarray(gradient * scale**2 / np.linalg.norm(gradient * scale))


@dataclass(frozen=True, slots=True, eq=False)
class Met:
    """A border that a branch meets."""

    at: AtBorder
    point: OrbitPoint  #: the cycle there, by the pieces of one side
    side: int  #: 0 if these are its own
    precision: float  #: of the parameter, by rounding


def border_met(curve: OrbitCurve, last: OrbitPoint, along: Floats, reach: float = 0.0) -> Met | None:
    """The border of a piece given by a formula that a branch meets next after a point; None where there is none.

    Args:
        along: unit tangent of the branch.
        reach: arclength within which the border is expected; 0 for the end of a branch, next to its last point.
    """
    return_map = curve.map_of(last.value)
    if not isinstance(return_map, PiecewiseMap):
        return None
    near = list(_near(curve, return_map, last, along, reach))
    own = sum((at.lowest[:1] for at in near), np.zeros(()))  # of all states that are beside the cut of an angle
    together = [replace(at, lowest=np.where(at.lowest == 0, own, at.lowest)) for at in near]
    found = [met for at in together for met in _located(curve, at, last, reach or CLOSE)]
    ahead = [(float(along @ curve.difference(met.point.y, last.y)), met) for met in found]
    ahead = [(way, met) for way, met in ahead if way >= -STALLED]
    if not ahead:
        return None
    first = min(ahead, key=lambda pair: pair[0])[1]
    met = replace(first, at=_all_at_once(curve, first, near))
    return met if not reach or _is_next(curve, met, along) else None


def _is_next(curve: OrbitCurve, met: Met, along: Floats) -> bool:
    """True if a border ahead is in the range, the branch does not bend before it, and the other states are in their pieces."""
    if met.side or not curve.low <= met.point.value <= curve.high or tangent(met.point, along) @ along < STRAIGHT:
        return False
    there = met.at.prolonged(curve.map_of(met.point.value), 0)
    return bool(there.first_return(met.point.orbit.states).valid.all())


def _near(curve: OrbitCurve, return_map: PiecewiseMap, last: OrbitPoint, along: Floats, reach: float) -> Iterator[AtBorder]:
    """The borders near the states of a cycle, or ahead of them, beyond which there is another piece, one at a time."""
    states = last.orbit.states
    letters, own, lowest = last.orbit.words, pieces_of(return_map, last), np.zeros(states.shape)
    values, gradients, rates = return_map.prolongation(own, lowest).borders(
        states, parameter_rates(curve.map_of, last.value, curve.unit, return_map)
    )
    sizes, cuts = np.linalg.norm(gradients * curve.scale, axis=-1), np.flatnonzero(curve.coordinates.angles)
    moved, ahead = curve.states(along), (np.abs(values) <= CLOSE * sizes) & (sizes > 0)
    feet = states[:, None] - (values / np.where(sizes > 0, sizes, 1.0) ** 2)[..., None] * gradients * curve.scale**2
    if reach:
        with np.errstate(divide="ignore", invalid="ignore"):
            way = -values / (np.einsum("kjn,kn->kj", gradients, moved) + rates * along[-1] * curve.unit)
        ahead = (way >= 0) & (way <= reach) & (sizes > 0)
        feet = states[:, None] + np.where(ahead, way, 0.0)[..., None] * moved[:, None]
    for k, j in zip(*np.nonzero(ahead), strict=True):
        step = BEYOND * _normal(gradients[k, j], curve.scale)
        found = return_map.first_return(curve.coordinates.wrap(np.array([feet[k, j] + step, feet[k, j] - step]))).words.tolist()
        cut = j - values.shape[1] + len(cuts)
        if letters[k] not in found or (found[0] == found[1] and cut < 0):
            continue
        sign = int(np.sign(values[k, j])) if found[0] == found[1] else 1 if found[0] == letters[k] else -1
        beyond = found[1] if sign > 0 else found[0]
        other = (*own[:k], return_map.letters.index(beyond) if beyond else -1, *own[k + 1 :])
        both = np.array([lowest, lowest])
        if cut >= 0:
            both[:, k, cuts[cut]] = (-np.pi, np.pi) if sign > 0 else (np.pi, -np.pi)
        yield AtBorder((int(k),), (int(j),), (sign,), own, other, both, tuple(range(len(own))))


def pieces_of(return_map: ReturnMap, point: OrbitPoint) -> tuple[int, ...]:
    """The numbers of the pieces of the states of a cycle."""
    letters = letters_of(return_map)
    return tuple(letters.index(word) for word in point.orbit.words)


def _located(curve: OrbitCurve, at: AtBorder, last: OrbitPoint, reach: float) -> Iterator[Met]:
    """The cycle at a border, by the pieces of the side on which slopes are finite; none where Newton's method fails."""
    for side in (0, 1) if min(at.other) >= 0 else (0,):
        there = replace(curve, map_of=at.along(curve.map_of, side))
        found = _solved(there, at, last.y)
        if found is not None and length(curve.difference(found[0].y, last.y)) <= 2 * reach:
            yield Met(at, found[0], side, found[1])
            return


def _solved(curve: OrbitCurve, at: AtBorder, y: Floats) -> tuple[OrbitPoint, float] | None:
    """The cycle whose first state at a border is on it, and the precision of its parameter; None where none is found."""
    last = np.inf
    for _ in range(STEPS):
        point = curve.evaluate(y)
        if point is None:
            return None
        distance, row = at.equation(curve, point, point.value)
        try:
            inverse = np.linalg.inv(np.vstack([point.jacobian, row]))
        except np.linalg.LinAlgError:
            return None
        step = -inverse @ np.append(point.residual, distance)
        now, y = length(step), point.y + step
        if not np.isfinite(now) or (now > STALLED and not now < 2 * last):
            return None
        if now <= ROUNDING or (now <= STALLED and now >= last / 2):
            error = 4 * ROUNDING * float(np.abs(inverse[-1]).sum() * (1 + np.abs(y[:-1]).max()))
            return (point, error * curve.unit + float(np.spacing(abs(point.value)))) if point.orbit.converged else None
        last = now
    return None


def _all_at_once(curve: OrbitCurve, first: Met, others: list[AtBorder]) -> AtBorder:
    """The first border with those at which other states are at the same time."""
    return_map, at = first.at.prolonged(curve.map_of(first.point.value), 0), first.at
    values, gradients, _ = return_map.borders(first.point.orbit.states)
    for each in others:
        k, j = each.states[0], each.borders[0]
        size = float(np.linalg.norm(gradients[k, j] * curve.scale))
        if k not in at.states and abs(values[k, j]) <= AT_ONCE * size:
            other, lowest = (*at.other[:k], each.other[k], *at.other[k + 1 :]), at.lowest.copy()
            lowest[:, k] = each.lowest[:, k]
            joined = at.states + each.states, at.borders + each.borders, at.signs + each.signs
            at = AtBorder(*joined, at.own, other, lowest, ())
    return replace(at, free=at.states)
