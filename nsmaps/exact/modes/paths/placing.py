"""Rows of a section's coordinates, some of which the others determine: whether they lie on it, and rows beside them that do."""

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.constants import MOST_PHASE
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.definitions.numbers import Numbers
from nsmaps.exact.modes.paths.arriving import features_of, velocities
from nsmaps.exact.modes.paths.refused import in_words
from nsmaps.exact.modes.tables.nonlinear import derived_at, start_states
from nsmaps.exact.modes.tables.tables import Tables

RANK = 1e-12  #: of the largest singular value: smaller ones are rounding
OFF = 1e-6  #: of the sizes of its terms and of its change in time: how far a function is from zero at most on its surface

#: of each start the functions that are zero there, shape (K, N); () where no coordinate is redundant
Surfaces = tuple[Floats, ...]


def surfaces_of(definition: Definition, table: Tables) -> Surfaces:
    """The functions that are zero at the events of a section, where not all coordinates are free."""
    if not all(start.zeros for start in definition.starts):
        return ()
    pairs = (table.functions.shape[1] - table.first.shape[1]) // 2
    numbers = (Numbers(start.surface, definition.symbols, pairs) for start in definition.starts)
    return tuple(one.floats(table.parameters.tolist()) for one in numbers)


def on_section(table: Tables, surfaces: Surfaces, rows: Floats) -> Bools:
    """Which rows of coordinates (N, m) lie on the surface of an event; rows that are not finite count among them."""
    known = np.ones(len(rows), bool)
    if surfaces:
        usual = np.flatnonzero(np.isfinite(rows).all(axis=1))
        known[usual] = _distances(table, surfaces, rows[usual]).min(axis=0, initial=np.inf) <= OFF
    return known


def nearest_on_section(table: Tables, surfaces: Surfaces, rows: Floats) -> Floats:
    """Rows of coordinates, those off the section with states moved onto the nearest surface, in proportion to their size."""
    moved, off = rows.copy(), np.flatnonzero(~on_section(table, surfaces, rows))
    if not len(off):
        return moved
    nearest, places = _distances(table, surfaces, rows[off]).argmin(axis=0), table.places
    states = np.flatnonzero(places >= 0)
    for i, k in zip(off.tolist(), nearest.tolist(), strict=True):
        change = (surfaces[k][:, : table.first.shape[1] - 1] @ _slopes(table, k, rows[i : i + 1]))[:, places[states]]
        units = np.abs(rows[i, states])
        units[units == 0] = units.max(initial=0.0) or 1.0
        (features,), _ = _features(table, k, rows[i : i + 1])
        correction, *_ = np.linalg.lstsq(change * units, surfaces[k] @ features, rcond=RANK)
        moved[i, states] -= units * correction
    return moved


def why_off(definition: Definition, table: Tables, surfaces: Surfaces, row: Floats) -> str:
    """On which surface a row does not lie, and a row that does."""
    (far,), (nearest,) = _distances(table, surfaces, row[None]).T, nearest_on_section(table, surfaces, row[None])
    k = int(far.argmin())
    (features,), _ = _features(table, k, row[None])
    values = surfaces[k] @ features
    event, side = definition.transitions[definition.starts[k].transition].name, "just after" if definition.after else "at"
    return (
        f"{in_words(definition.coordinates, row)} is not on the section: a function that is zero {side} {event!r} is "
        f"{values[abs(values).argmax()]:.6g} there, as not all coordinates are free; expected: such as "
        f"{in_words(definition.coordinates, nearest)} (`on_section` of the system)."
    )


def _states(table: Tables, k: int, rows: Floats) -> tuple[Floats, Floats, Floats]:
    """The own states of rows at one start, shape (M, own), their derivatives by states (M, own, own), and phases (M,)."""
    own, places = table.own, table.places
    given, phase = np.zeros((len(rows), own)), np.full(len(rows), table.phase)
    given[:, places[places >= 0]] = rows[:, places >= 0]
    if (places < 0).any():
        (phase,) = rows[:, places < 0].T
    phase = np.where(np.abs(phase) <= MOST_PHASE, phase, 0.0) % TWO_PI
    return *start_states(table, k, given, features_of(table, given, phase), phase), phase


def _features(table: Tables, k: int, rows: Floats) -> tuple[Floats, Floats]:
    """The features of rows at one start, shape (M, N), and their phases (M,)."""
    states, _, phase = _states(table, k, rows)
    return features_of(table, states, phase), phase


def _slopes(table: Tables, k: int, row: Floats) -> Floats:
    """The derivatives of own and derived states at one start, for a row of shape (1, m), by own states, shape (n, own)."""
    states, (slopes,), phase = _states(table, k, row)
    (derived,) = derived_at(table, states, phase)[..., 1 : table.own + 1]
    return np.concatenate([slopes, derived @ slopes])


def _distances(table: Tables, surfaces: Surfaces, rows: Floats) -> Floats:
    """How far rows are from the surfaces of each start, as a share of sizes of terms and of changes in a longest step."""
    found = []
    for k, functions in enumerate(surfaces):
        transition = int(table.starts[k])
        mode = int(table.target[transition] if table.after else table.mode[transition])
        features, phase = _features(table, k, rows)
        sizes = np.abs(features) @ np.abs(functions).T + np.abs(velocities(table, mode, features, phase) @ functions.T)
        values = np.abs(features @ functions.T)
        with np.errstate(invalid="ignore", divide="ignore"):
            found.append(np.where(values == 0, 0.0, values / sizes).max(axis=1, initial=0.0))
    return np.array(found)
