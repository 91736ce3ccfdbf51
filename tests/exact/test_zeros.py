"""What is zero just after an event, whatever the state, is decided once in many digits: for returns and for images of boxes."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy as sp

from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.exact.modes.enclosure.tables import ball_tables

FORMS = {
    "itself": (1, sp.Rational(1, 10)),
    "root": (sp.sqrt(2), sp.Rational(1, 10)),
    "floats": (0.3, 0.1),  # the coefficients are in proportion but for their last digits
}


class Pair(HybridSystem):
    """A ball whose slanted surface is watched twice, the second time times a share and with another constant."""

    gap: float = 0.0
    form: str = "itself"
    states = ("x", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"flight": {"x": y.v, "v": -1}, "other": {"x": y.v, "v": -1}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        share, slope = FORMS[self.form]
        first, second = 3 * slope * y.x - slope * y.v, share * 3 * slope * y.x - share * slope * y.v + self.gap
        return {"I": Guard("flight", first, to="other"), "J": Guard("other", second, to="flight", reset={"v": -y.v})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("J", ("x", "v"))


@pytest.mark.parametrize(
    ("system", "zero"),
    [
        (Pair(), True),
        (Pair(form="root"), True),
        (Pair(form="floats"), True),
        (Pair(gap=1e-15), False),
        (Pair(gap=-1e-300), False),
    ],
)
def test_a_surface_is_zero_where_it_is_a_multiple_but_for_floats_in_formulas(system: Pair, zero: bool) -> None:
    kernel = system._kernel()
    table = kernel.table
    (event,) = np.flatnonzero(table.mode == kernel.definition.modes.index("flight"))
    (function,) = table.function[table.mode == kernel.definition.modes.index("other")]
    assert (table.on[event, function] > 0) == zero
    assert ball_tables(kernel.definition, kernel.values, table).on[event, function] == zero
