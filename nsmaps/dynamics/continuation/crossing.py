"""The other branch at a point where two branches of periodic orbits cross: the second root of the bifurcation equation.

There the derivative of the equations has two null vectors, whose combinations v with w F'' v v = 0 are the tangents, w the left
null vector: H. B. Keller, in: Applications of Bifurcation Theory, Academic Press (1977) 359.
"""

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint

STEP = 1e-4  #: of the differences of the derivative along the null vectors, in the curve's units


def other_tangent(curve: OrbitCurve, here: OrbitPoint, own: Floats) -> Floats | None:
    """The unit tangent of the other branch at a point where one with the tangent `own` is crossed; None where none is found."""
    left, _, right = np.linalg.svd(here.jacobian)
    null, w = right[-2:], left[:, -1]
    form = np.empty((2, 2))
    for row, along in zip(form, null, strict=True):
        low, high = (curve.evaluate(here.y + sign * STEP * along) for sign in (-1, 1))
        if low is None or high is None or not (curve.connects(here, low) and curve.connects(here, high)):
            return None
        row[:] = w @ (high.jacobian - low.jacobian) @ null.T
    values, vectors = np.linalg.eigh(form + form.T)
    if not values[0] < 0 < values[1]:
        return None
    shares = np.sqrt([values[1], -values[0]])
    tangents = (np.array([[1, 1], [1, -1]]) * shares) @ vectors.T @ null
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    return np.asarray(tangents[np.argmin(np.abs(tangents @ own))])
