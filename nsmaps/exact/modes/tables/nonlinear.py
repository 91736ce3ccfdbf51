"""The fields of a table that describe Taylor flights: the compiled programs and laws of a nonlinear system."""

import ctypes
from typing import Any

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.taylor.kinds import NO_KIND

POINTER = ctypes.c_void_p
LAW = ctypes.CFUNCTYPE(None, ctypes.c_double, POINTER, POINTER, POINTER)  #: phase; addresses of states, parameters and table


def taylor_of(definition: Definition) -> dict[str, Any]:
    """The fields of a table, zero of a system whose modes are all affine. Raises as `nsmaps.exact.taylor.programs.steps_of`."""
    modes, own = len(definition.modes), len(definition.states)
    if not definition.smooth:
        none = {name: np.zeros(modes, np.int64) for name in ("taylor", "rates")}
        sizes = {"variations": np.zeros((2, modes), np.int64), "kinds": np.empty((modes, 0), np.int64)}
        return {**none, **sizes, "nonlinear": (), "derived": 0, "own": own}
    from nsmaps.exact.taylor.laws import derived_law, flat_kinds, rate_law
    from nsmaps.exact.taylor.programs import FLIGHT, steps_of

    kinds = flat_kinds(definition)
    table = np.full((modes, max(map(len, kinds))), NO_KIND)
    for row, given in zip(table, kinds, strict=True):
        row[: len(given)] = given
    return {
        "nonlinear": (1,),
        "taylor": np.array(steps_of(definition, FLIGHT)),
        "variations": np.zeros((2, modes), np.int64),
        "rates": np.array(rate_law(definition)),
        "derived": derived_law(definition),
        "own": own,
        "kinds": table,
    }


def write_variations(definition: Definition, variations: Ints, along: bool) -> None:
    """Write the programs of derivatives of flights, `along` a direction of the parameters too, when they are first asked for."""
    if definition.smooth and not variations[int(along)].any():
        from nsmaps.exact.taylor.programs import ALONG, BY_START, steps_of

        variations[int(along)] = steps_of(definition, ALONG if along else BY_START)


def derived_at(table: Any, states: Floats, phase: Floats) -> Floats:
    """What the law of the derived states writes at own states (M, own) and phases (M,), shape (M, R, own + P + 3)."""
    own, count = table.own, len(table.parameters)
    return write_by_law(table, table.derived, states, phase, (table.first.shape[1] - 1 - own, own + count + 3))


def start_states(table: Any, k: int, given: Floats, features: Floats, phase: Floats) -> tuple[Floats, Floats]:
    """Own states (M, own) at a start, by own states with the coordinates among them, their features, and phases (M,).

    Also their derivatives by these, shape (M, own, own).
    """
    own, count = table.own, len(table.parameters)
    rows, curved = table.states[k, :own], table.start_curved[k]
    law = write_by_law(table, table.start_laws[k], given, phase, (own, own + count + 2))
    values, *_ = np.moveaxis(law, -1, 0)
    return np.where(curved, values, features @ rows.T), np.where(curved[:, None], law[..., 1 : own + 1], rows[:, :own])


def rates_at(table: Any, mode: int, states: Floats, phase: Floats) -> Floats:
    """The rates of own and derived states in a mode with Taylor flights, shape (M, n), as `derived_at`."""
    own, flat = table.own, table.kinds.shape[1]
    written = write_by_law(table, table.rates[mode], states, phase, (own * (own + 3) + flat * (own + 2),))
    rates, derived, by_phase = written[:, : own * (own + 3) : own + 3], derived_at(table, states, phase), own + 1
    more = np.einsum("mri,mi->mr", derived[..., 1:by_phase], rates) + table.rate * derived[..., by_phase]
    return np.concatenate([rates, more], axis=1)


def write_by_law(table: Any, address: int, states: Floats, phase: Floats, shape: tuple[int, ...]) -> Floats:
    """What a law writes at states and phases, one after the other."""
    rows, out = np.ascontiguousarray(states), np.zeros((len(states), *shape))
    if address:
        law, parameters = LAW(int(address)), table.parameters.ctypes.data
        states_at, written_at = (x.ctypes.data + x.nbytes // max(len(x), 1) * np.arange(len(x)) for x in (rows, out))
        for phi, state, place in zip(phase.tolist(), states_at.tolist(), written_at.tolist(), strict=True):
            law(phi, state, parameters, place)
    return out
