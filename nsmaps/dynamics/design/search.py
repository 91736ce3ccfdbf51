"""The search for an optimum under smooth conditions: SLSQP with exact gradients of the observable."""

from dataclasses import dataclass, field

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.design.problem import Point, Problem

TOLERANCE = 1e-14  #: of the value, as a share of the largest one known, at which SLSQP ends
ITERATIONS = 200  #: of SLSQP, at most
FLAT = 1e-9  #: of the value, as a share of the same, within which values are one
MOST_LOST = 40  #: points without the motion, and without progress between them, after which a search ends
PROGRESS = 1e-8  #: of the value, as a share of the same
MET = 1e-8  #: by how much a condition may be missed
NEAREST = 1 / 64  #: share of the way from the first motion to a start at which it is tried last
LOST = "at the edge of where the motion is found"
BEYOND = 1e-2, 1e-3  #: steps, as shares of the ranges, from where a search ends to where it continues


class _MotionLostError(Exception):
    """The motion is not found where a gradient is needed, or too often."""


@dataclass(slots=True, eq=False)
class Search:
    """A search over the parameters as shares of their ranges, which minimises the sign times the value."""

    problem: Problem
    sign: float
    scale: float = 1.0  #: unit of what is minimised
    seen: dict[bytes, tuple[Point | None, Floats]] = field(default_factory=dict)  #: the motion at parameters, and its conditions

    def here(self, at: Floats) -> tuple[Point | None, Floats]:
        """The motion at parameters (k,) and its conditions (c,); where it is lost, None, and none of them is met."""
        key = at.tobytes()
        if key not in self.seen:
            point = self.problem.point(at.copy())
            first = self.problem.known[0]
            conditions = self.problem.conditions(*((first.system, first.orbit) if point is None else (point.system, point.orbit)))
            self.seen[key] = point, np.full_like(conditions, -1.0) if point is None else conditions
        return self.seen[key]

    def met(self, at: Floats) -> bool:
        """Whether the motion is there and all conditions are met."""
        point, conditions = self.here(at)
        return point is not None and bool(conditions.min(initial=0.0) >= -MET) and self.problem.stable(point.orbit)

    def sought(self, at: Floats) -> float:
        """What is minimised, of order one; infinite where the motion is lost, which shortens the step."""
        point = self.here(at)[0]
        return np.inf if point is None else self.sign * point.value / self.scale

    def begun(self, at: Floats) -> Floats:
        """The parameters on the way from the first motion at which it is found: at the end, half way, a quarter and so on."""
        first, share = self.problem.known[0].at, 1.0
        while share >= NEAREST:
            there = first + share * (at - first) if share < 1 else at
            if self.here(there)[0] is not None:
                return there
            share /= 2
        return first

    def kept(self, end: Floats, since: int) -> Floats:
        """The parameters where a search ends if all conditions are met there, otherwise the best ones since where they are."""
        points = [] if self.met(end) else sorted(self.problem.known[since:], key=lambda point: self.sign * point.value)
        return next((point.at for point in points if self.met(point.at)), end)

    def flat(self, end: Floats) -> bool:
        """Whether all motions met have one value, those on the way to a corner far from the end of a search included."""
        self.begun(np.where(end < 0.5, 1.0, 0.0))
        return bool(np.ptp([point.value for point in self.problem.known]) <= FLAT * self.problem.size)

    def beyond(self, at: Floats, way: Floats) -> tuple[Floats | None, bool]:
        """Better parameters a little further along a direction (k,), and whether the motion is lost there.

        The first meet all conditions; no array where there are none.
        """
        lost = False
        for step in BEYOND:
            there = np.clip(at + step * way / np.linalg.norm(way), 0.0, 1.0)
            lost = self.here(there)[0] is None
            if self.met(there) and self.sought(there) < self.sought(at):
                return there, lost
        return None, lost

    def run(self, at: Floats) -> tuple[Floats, str]:
        """The parameters at which SLSQP ends from others, and why."""
        from scipy.optimize import minimize

        self.scale = self.problem.size
        last, best, lost = at.copy(), np.inf, 0

        def sought(x: Floats) -> float:
            nonlocal best, lost
            value = self.sought(x)
            best, lost = (value, 0) if value < best - PROGRESS else (best, lost + (value == np.inf))
            if lost > MOST_LOST:
                raise _MotionLostError
            return value

        def sure(x: Floats) -> Point:
            point = self.here(x)[0]
            if point is None:
                raise _MotionLostError
            last[:] = x
            return point

        rule = {"type": "ineq", "fun": lambda x: self.here(x)[1], "jac": lambda x: self.problem.slopes(sure(x))}
        try:
            found = minimize(
                sought,
                at,
                jac=lambda x: self.sign * sure(x).gradient / self.scale,
                bounds=[(0.0, 1.0)] * len(at),
                constraints=[rule],
                method="SLSQP",
                options={"ftol": TOLERANCE, "maxiter": ITERATIONS},
            )
        except _MotionLostError:
            return last, LOST
        end = np.asarray(found.x)
        return (last, LOST) if self.here(end)[0] is None else (end, str(found.message))
