"""First returns where not all coordinates of a section are free: coordinates beside its surface have no image."""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.returns import INVALID
from nsmaps.exact.modes.march.flight import dot, velocity
from nsmaps.exact.modes.march.returns import first_return
from nsmaps.exact.modes.march.section import phase_of
from nsmaps.exact.modes.paths.placing import OFF
from nsmaps.exact.modes.tables.taylor import features


@inner
def distance(p, surfaces, k, z, field):
    """How far features are from the surface of a start, as in `paths.placing`; `surfaces` has rows, shape (starts, K, N)."""
    velocity(p, p.target[p.starts[k]] if p.after else p.mode[p.starts[k]], z, field)
    far = 0.0
    for j in range(surfaces.rows.shape[1]):
        value, size = dot(surfaces.rows[k, j], z)
        size += abs(dot(surfaces.rows[k, j], field)[0])
        if value != 0.0:
            far = max(far, abs(value) / size)
    return far


@inner
def on_section(p, surfaces, row, w):
    """Whether coordinates lie on the surface of an event; those that are not finite count among them."""
    phi = phase_of(p, row)
    if math.isnan(phi):
        return True
    n = p.first.shape[1] - 1
    features(phi, w.other, n)
    features(phi, w.z, n)
    for i in range(n):
        w.other[i] = 0.0
    for c in range(len(p.places)):
        if p.places[c] >= 0:
            w.other[p.places[c]] = row[c]
    for k in range(len(p.starts)):
        for i in range(n):
            w.z[i] = dot(p.states[k, i], w.other)[0]
        if distance(p, surfaces, k, w.z, w.field) <= OFF:
            return True
    return False


@inner
def first_return_from_section(p, surfaces, row, image, tangent, w):
    """As `first_return`; coordinates beside the section have no image."""
    if on_section(p, surfaces, row, w):
        return first_return(p, row, image, tangent, w)
    for c in range(len(image)):
        image[c] = math.nan
    return INVALID, 0, math.nan, 0
