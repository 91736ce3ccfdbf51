"""First returns where not all coordinates of a section are free: coordinates beside its surface have no image."""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.returns import INVALID
from nsmaps.exact.modes.flights.states import dot, features, velocity
from nsmaps.exact.modes.march.returns import Return, first_return
from nsmaps.exact.modes.march.starting import apply_start_law, phase_of
from nsmaps.exact.modes.paths.placing import OFF


@inner
def distance(p, surfaces, k, w):
    """How far features are from the surface of a start, as in `paths.placing`; `surfaces` has rows, shape (starts, K, N)."""
    velocity(p, p.target[p.starts[k]] if p.after else p.mode[p.starts[k]], w.z, w.field, w)
    far = 0.0
    for j in range(surfaces.rows.shape[1]):
        value, size = dot(surfaces.rows[k, j], w.z)
        size += abs(dot(surfaces.rows[k, j], w.field).value)
        if value != 0.0:
            far = max(far, abs(value) / size)
    return far


@inner
def on_section(p, surfaces, row, w):
    """Whether coordinates lie on the surface of an event; those that are not finite count among them."""
    phi, n = phase_of(p, row), p.first.shape[1] - 1
    if math.isnan(phi):
        return True
    features(p, phi, w)
    for j in range(len(w.z)):
        w.other[j] = w.z[j] if j >= n else 0.0
    for c in range(len(p.places)):
        if p.places[c] >= 0:
            w.other[p.places[c]] = row[c]
    for k in range(len(p.starts)):
        for i in range(n):
            w.z[i] = dot(p.states[k, i], w.other).value
        if p.start_laws[k] != 0:
            apply_start_law(p, k, phi, w.z, w)
        if distance(p, surfaces, k, w) <= OFF:
            return True
    return False


@inner
def return_of_row(p, row, image, tangent, w):
    """The first return of coordinates, which have a start; its image and the derivatives are written."""
    found = first_return(p, row, w)
    for c in range(len(image)):
        image[c] = w.image[c]
        for j in range(w.dz.shape[1]):
            tangent[c, j] = w.tangent[c, j]
    return found


@inner
def first_return_from_section(p, surfaces, row, image, tangent, w):
    """As `return_of_row`; coordinates beside the section have no image."""
    if on_section(p, surfaces, row, w):
        return return_of_row(p, row, image, tangent, w)
    for c in range(len(image)):
        image[c] = math.nan
    return Return(INVALID, 0, math.nan, 0)
