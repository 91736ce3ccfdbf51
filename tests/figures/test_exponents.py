"""The figure of exponents of a map, where a return takes a unit of time: one panel."""

from types import SimpleNamespace

import numpy as np
import pytest

from nsmaps.figures.parameters.lyapunov import sheets


@pytest.mark.parametrize(("share", "panels"), [(1.0, 1), (0.5, 2)])
def test_a_second_panel_is_drawn_where_it_differs(share: float, panels: int) -> None:
    exponents = np.array([[0.1, -np.inf], [0.2, np.nan]])
    sweep = SimpleNamespace(exponents=exponents, per_time=share * exponents)
    (sheet,) = sheets(sweep)  # type: ignore[arg-type]
    assert len(sheet.panels) == panels
