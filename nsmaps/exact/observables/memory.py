"""What the loops of observables work in: compiled formulas, which impacts and flights count, and the totals."""

from typing import Any, NamedTuple

import numpy as np

NODES, WEIGHTS = 0.5 * np.array(np.polynomial.legendre.leggauss(12))  #: of Gauss's rule in a panel, shape (12,)
NODES += 0.5  #: on [0, 1], where the weights have the sum 1
PANEL = 3.0  #: length of a panel, in units of the fastest rate: products of three states are integrated to rounding
VALUE, BY_INPUT = range(2)  #: columns of what formulas give: the value, its derivatives by inputs, then by phase and parameters


class Quantities(NamedTuple):
    """K formulas of impacts and F of flights of a system; D inputs of formulas, the phase and parameters not counted."""

    impact: int  #: address of the compiled formulas of impacts, 0 without any
    flight: int  #: and of those of flights
    parameters: Any  #: shape (P,)
    at: Any  #: shape (R, K), whether an impact on a wall, or a transition, counts
    over: Any  #: shape (M, F), whether a flight from a wall, or in a mode, counts
    departed: bool  #: whether flights with modes count by the letter of the event at which they begin
    largest: Any  #: shape (K + F,), whether the largest value takes the place of the sum
    panel: float  #: the longest part of a flight that one rule covers
    rough: bool  #: whether a formula of flights may have kinks or jumps, or be steep, so that a rule may cover less
    y: Any  #: shape (D,), what the formulas take
    out: Any  #: shape (max(K, F), 1 + derivatives), what they give
    total: Any  #: shape (K + F,)
    peak: Any  #: shape (F,), largest value of the samples of a flight
    when: Any  #: shape (F,), its time
    gap: Any  #: shape (F,), difference of a rule from those on both halves
    size: Any  #: shape (F,), largest magnitude of the samples
