"""Bounds of what decays are those of its maximum, not of the horizon."""

import numpy as np
import pytest
import sympy as sp

from nsmaps.exact.bounding import bound as bound_on
from nsmaps.exact.symbols import Flow, S


@pytest.mark.parametrize(
    ("expr", "rate"),
    [
        (S**2 * sp.exp(-S / 2), -0.5),
        (S * sp.exp(-3 * S), -3.0),
        (S**3 * sp.exp(-S / 1000), -0.001),
        (S * sp.exp(S / 50), 0.02),
        (S**2 * sp.exp(-S) * sp.cos(2 * S), -1.0),
        (sp.exp(-S) - sp.exp(-2 * S), -1.0),
    ],
)
def test_powers_times_exponentials(expr, rate):
    flow = Flow()
    bound = float(bound_on(flow, flow.split(expr), sp.Integer(100)))
    s = np.linspace(0, 100, 400_001)
    largest = np.abs(sp.lambdify(S, expr, "numpy")(s)).max()
    assert largest <= bound * (1 + 1e-12)
    assert bound < 9 * largest
