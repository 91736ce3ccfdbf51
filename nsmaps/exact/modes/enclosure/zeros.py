"""Which functions of guards are zero just after events, and which of these surely do not fall there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb_mat

from nsmaps.arrays import Bools
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.tables.tables import Tables, first_choices, mode_of
from nsmaps.exact.modes.tables.vanishing import ball_rows, features_after, flows_of, independent_rows, is_combination, reduce_row


@dataclass(frozen=True)
class Facts:
    """A system in many digits, with N features."""

    table: Tables
    flows: list[arb_mat]  #: z' by z in each mode
    functions: list[arb_mat]  #: those watched, shape (1, N)
    resets: list[arb_mat]  #: of the events: the features after it by those before it
    starts: list[arb_mat]  #: the features at the events of the section by the coordinates

    @property
    def fields(self) -> dict[str, Bools]:
        """The fields `on`, `started` and `rises` of a table for enclosures.

        A function is zero in proportion to that of the event, or to one that is zero as long as the mode lasts, as the sliding
        velocity in stick.
        """
        table, count = self.table, range(len(self.functions))
        on, started, modes = table.on > 0, np.zeros((len(self.starts), len(count)), bool), [mode_of(table, f) for f in count]
        lasting = [
            independent_rows([self.functions[f].entries() for f in count if self.lasts(mode, f)])
            for mode in range(len(self.flows))
        ]
        for f, function in enumerate(self.functions):
            for k, reset in enumerate(self.resets):
                on[k, f] |= modes[f] == table.target[k] and is_combination(function * reset, lasting[table.mode[k]])
            for b, k in enumerate(table.starts):
                by = self.starts[b] if table.after else self.resets[k] * self.starts[b]
                started[b, f] = on[k, f] or is_combination(function * by, [])
        rises = [[bool(on[k, f]) and self.rises(k, f) for f in count] for k in range(len(self.resets))]
        return {"on": on, "started": started, "rises": np.array(rises)}

    def lasts(self, mode: int, f: int) -> bool:
        """Whether a function is zero throughout a mode: at all ways into it, and the flow keeps it so."""
        function, table = self.functions[f], self.table
        ways = [reset for k, reset in enumerate(self.resets) if table.target[k] == mode]
        ways += [self.starts[b] for b, k in enumerate(table.starts) if (table.target if table.after else table.mode)[k] == mode]
        kept = is_combination(function * self.flows[mode], independent_rows([function.entries()]))
        return kept and all(is_combination(function * by, []) for by in ways)

    def rises(self, k: int, f: int) -> bool:
        """Whether the rate of a function after an event is the negative, times a share, of that of the event's function at it."""
        mode, own = mode_of(self.table, f), self.functions[self.table.function[k]]
        if mode != self.table.target[k]:
            return False
        rate, row = own * self.flows[self.table.mode[k]], self.functions[f] * self.flows[mode] * self.resets[k]
        basis = independent_rows([own.entries()])
        after, before = (reduce_row(x.entries(), basis) for x in (row, rate))
        multiples = independent_rows([before])
        shares = [after[lead] / before[lead] for lead, _ in multiples]
        return is_combination(arb_mat([after]), multiples) and all(share < 0 or share.contains(0) for share in shares)


def facts_of(definition: Definition, values: Sequence[float], table: Tables) -> Facts:
    """The facts of a system at values of its parameters, by which its table is given."""
    _, width = table.functions.shape
    rows, ((rate, *_), *_) = ball_rows(definition, values, width), definition.scalars.at(values)
    functions = [arb_mat([list(rows.functions[k])]) for k in first_choices(table)]
    resets, starts = (list(map(features_after, states)) for states in (rows.resets, rows.starts))
    return Facts(table, flows_of(rows, rate), functions, resets, starts)
