"""The state at the section that coordinates give, with its derivatives by them or by the parameters."""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.constants import MOST_PHASE
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.law import call_reset
from nsmaps.exact.modes.flights.laws import VALUE, parameter_column, slope_column
from nsmaps.exact.modes.flights.states import derive, dot, features, shift
from nsmaps.exact.modes.march.section import (
    away,
    below_after,
    check_conditions,
    contact_distance,
    contact_of,
    falling,
    reset,
    seen_before,
)
from nsmaps.exact.modes.tables.memory import ALONG
from nsmaps.exact.modes.tables.taylor import AT_ONCE, EQUAL


@inner
def apply_start_law(p, k, phi, z, w):
    """Write the states that no row of the coordinates in `w.other` gives, and to `w.curved` their derivatives."""
    call_reset(p.start_laws[k], phi, w.other.ctypes.data, p.parameters.ctypes.data, w.curved.ctypes.data)
    for i in range(p.own):
        z[i] = w.curved[i, VALUE] if p.start_curved[k, i] else z[i]


@inner
def choose_start(p, row, phi, w):
    """Write the features at the section that coordinates give; the number of the start, -1 for coordinates outside of the domain.

    Among several starts it is the one whose state lies nearest to its surface, or one in lasting contact that is pressed; of
    those that are as near it is one whose function falls, and of these the one in whose mode fewest clocks and other functions
    are below zero: they distinguish modes with one surface.
    """
    n, best, least, falls, fewest, given = p.first.shape[1] - 1, -1, math.inf, False, 0, w.other
    features(p, phi, w)
    for j in range(len(w.z)):
        given[j] = w.z[j] if j >= n else 0.0
    for c in range(len(p.places)):
        if p.places[c] >= 0:
            given[p.places[c]] = row[c]
    for k in range(len(p.starts)):
        for i in range(n):
            w.z[i], _ = dot(p.states[k, i], given)
        if p.start_laws[k] != 0:
            apply_start_law(p, k, phi, w.z, w)
        derive(p, w.z, w)
        holds, _ = check_conditions(p, p.starts[k], w.z, w)
        far = away(p, k, w) if len(p.starts) > 1 else 0.0
        j = contact_of(p, p.mode[p.starts[k]])
        if j >= 0:
            far = max(far, contact_distance(p, j, w.z))
            far = -1.0 if far <= EQUAL else far
        same = seen_before(p, p.starts[k])
        down = not same or falling(p, p.starts[k], w)
        count = below_after(p, p.starts[k], w) if len(p.starts) > 1 else 0
        better = down > falls or (down == falls and count < fewest)
        if (holds or not same) and (far < least - AT_ONCE or (far <= least + AT_ONCE and better)):
            best, least, falls, fewest = k, far, down, count
            for i in range(n):
                w.new[i] = w.z[i]
    for i in range(n):
        w.z[i] = w.new[i]
    derive(p, w.z, w)
    return best


@inner
def phase_of(p, row):
    """The phase that coordinates give, within a turn, without one that of the section; NaN outside of the domain."""
    phi = p.phase
    for c in range(len(p.places)):
        if not math.isfinite(row[c]):
            return math.nan
        if p.places[c] < 0:
            phi = row[c]
    return phi - math.floor(phi / TWO_PI) * TWO_PI if abs(phi) <= MOST_PHASE else math.nan


@inner
def launch(p, start, row, phi, w):
    """Write how the features at a start change with the coordinates."""
    n, width, directions = p.first.shape[1] - 1, len(w.z), w.dz.shape[1]
    if w.moved.here:
        launch_moved(p, start, row, phi, w)
        return
    for c in range(directions):
        w.dphi[c] = 1.0 if p.places[c] < 0 else 0.0
    shift(p, w)
    for c in range(directions):
        w.dz[n, c] = 0.0
        for i in range(n):
            if p.places[c] >= 0:
                w.dz[i, c] = p.states[start, i, p.places[c]]
            else:
                w.dz[i, c] = 0.0
                for j in range(n + 1, width):
                    w.dz[i, c] += p.states[start, i, j] * w.dz[j, c]
    if p.start_laws[start] != 0:
        launch_by_law(p, start, phi, w)


@inner
def launch_by_law(p, start, phi, w):
    """Write how the states that a law gives at a start change with the coordinates, or with the parameters."""
    apply_start_law(p, start, phi, w.z, w)
    for i in range(p.own):
        if p.start_curved[start, i]:
            for c in range(w.dz.shape[1]):
                w.dz[i, c] = w.curved[i, slope_column(p.own)] * w.dphi[c]
                if w.moved.here:
                    for k in range(len(p.parameters)):
                        w.dz[i, c] += w.curved[i, parameter_column(p, k)] * w.moved.parameters[k]
                elif p.places[c] >= 0:
                    w.dz[i, c] = w.curved[i, slope_column(p.places[c])]


@inner
def launch_moved(p, start, row, phi, w):
    """Write how the start changes with the parameters, at fixed coordinates."""
    n, width = p.first.shape[1] - 1, len(w.z)
    for j in range(n):
        w.other[j] = 0.0
    for c in range(len(p.places)):
        if p.places[c] >= 0:
            w.other[p.places[c]] = row[c]
    for j in range(n, width):
        w.other[j], w.dz[j, ALONG] = w.z[j], 0.0
    w.dphi[ALONG] = w.moved.phase
    shift(p, w)
    for i in range(n):
        w.dz[i, ALONG], _ = dot(w.moved.states[start, i], w.other)
        for j in range(n + 1, width):
            w.dz[i, ALONG] += p.states[start, i, j] * w.dz[j, ALONG]
    if p.start_laws[start] != 0:
        launch_by_law(p, start, phi, w)


@inner
def find_start(p, row, w):
    """The transition at the start, -1 for a row outside of the domain, and the phase within a turn; features are written."""
    phi = phase_of(p, row)
    start = -1 if math.isnan(phi) else choose_start(p, row, phi, w)
    if start < 0:
        return -1, 0.0
    launch(p, start, row, phi, w)
    k = p.starts[start]
    j = contact_of(p, p.mode[k])
    if j >= 0:
        reset(p, j, phi, w)
    return (k, phi) if not seen_before(p, k) or falling(p, k, w) else (-1, 0.0)
