"""Which functions of guards are zero just after events, and which of these surely do not fall there."""

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.exact.modes.tables.tables import Tables
from nsmaps.exact.modes.tables.vanishing import SAME


def mode_of(table: Tables, function: int) -> int:
    """The mode in which a function is watched."""
    return int(np.searchsorted(table.watched, function, side="right")) - 1


def multiple(row: Floats, of: Floats, size: Floats) -> bool:
    """Whether a row, a sum of terms of a size, is a multiple of another but for rounding."""
    lead = int(np.argmax(np.abs(of)))
    factor = row[lead] / of[lead] if of[lead] else 0.0
    return bool((np.abs(row - factor * of) <= SAME * (size + np.abs(factor * of))).all())


def zeros_of(table: Tables, flows: Floats, functions: Floats) -> dict[str, Bools]:
    """The fields `on`, `started` and `rises` of a table for enclosures, from its flows and its functions with derivatives."""
    n = table.resets.shape[1]
    whole = [np.vstack([reset, np.eye(reset.shape[1])[n:]]) for reset in table.resets]
    started = [np.vstack([states, np.eye(states.shape[1])[n:]]) for states in table.states]
    on, begun = vanishing(table, flows, functions[:, 0], whole, started)
    return {"on": on, "started": begun, "rises": rising(table, functions, whole, on)}


def vanishing(table: Tables, flows: Floats, functions: Floats, whole: list[Floats], started: list[Floats]) -> tuple[Bools, Bools]:
    """Which functions are zero just after which events, and at which starts: in proportion to that of the event, or to one that
    is zero as long as the mode lasts, as the sliding velocity in stick.
    """
    count = len(functions)
    on, begun = table.on > 0, np.zeros((len(table.starts), count), bool)
    kept = {m: [f for f in range(count) if _lasts(table, flows, functions, whole, started, m, f)] for m in range(len(flows))}
    for f, function in enumerate(functions):
        for k, by in enumerate(whole):
            row, size = function @ by, np.abs(function) @ np.abs(by)
            on[k, f] |= any(multiple(row, functions[g], size) for g in kept[table.mode[k]])
        for b, (states, k) in enumerate(zip(started, table.starts, strict=True)):
            by = states if table.after else whole[k] @ states
            begun[b, f] = on[k, f] or multiple(function @ by, np.zeros(len(function)), np.abs(function) @ np.abs(by))
    return on, begun


def _lasts(
    table: Tables, flows: Floats, functions: Floats, whole: list[Floats], started: list[Floats], mode: int, f: int
) -> bool:
    """Whether a function is zero throughout a mode: at all ways into it, and the flow keeps it so."""
    function, none = functions[f], np.zeros(functions.shape[1])
    ways = [whole[k] for k in range(len(whole)) if table.target[k] == mode]
    ways += [started[b] for b, k in enumerate(table.starts) if (table.target if table.after else table.mode)[k] == mode]
    zero = all(multiple(function @ by, none, np.abs(function) @ np.abs(by)) for by in ways)
    return zero and multiple(function @ flows[mode], function, np.abs(function) @ np.abs(flows[mode]))


def rising(table: Tables, rates: Floats, whole: list[Floats], on: Bools) -> Bools:
    """Which functions that are zero after an event have a rate then that is the negative, times a share, of the rate at it."""
    found = np.zeros(on.shape, bool)
    for k, by in enumerate(whole):
        own = rates[table.function[k], :2]
        for f in np.flatnonzero(on[k]):
            if mode_of(table, int(f)) == table.target[k]:
                row, size = rates[f, 1] @ by, np.abs(rates[f, 1]) @ np.abs(by)
                scale = np.abs(own).max(axis=1)
                shares = np.linalg.lstsq(own.T / scale, row, rcond=None)[0] / scale if scale.all() else np.zeros(2)
                left = np.abs(row - shares @ own)
                found[k, f] = shares[1] <= 0 and bool((left <= SAME * (size + np.abs(shares) @ np.abs(own))).all())
    return found
