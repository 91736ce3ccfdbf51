"""Variables of maps: formulas of the coordinates as text, with their values, derivatives and symbols."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.reduced.conditions.algebras import Evaluate, Numbers, Symbols
from nsmaps.reduced.conditions.fold import fold_term


def values_of(texts: Sequence[str], names: Sequence[str], states: Floats) -> Floats:
    """The values of k formulas of the n named coordinates at states (N, n), shape (N, k); NaN where one is not real."""
    values = np.empty((len(states), len(texts)))
    with np.errstate(all="ignore"):
        for column, text in zip(values.T, texts, strict=True):
            column[:] = _evaluate(text, tuple(map(str, names)))(states.T)
    return values


def jacobian_of(texts: Sequence[str], names: Sequence[str], states: Floats) -> Floats:
    """The derivatives of k formulas by the n named coordinates at states (N, n), shape (N, k, n)."""
    each = slopes_of(tuple(texts), tuple(map(str, names)))
    flat = values_of([text for row in each for text in row], names, states)
    return flat.reshape(len(states), len(texts), len(names))


@lru_cache(maxsize=64)
def slopes_of(texts: tuple[str, ...], names: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
    """The derivatives of formulas as formulas, one for each of the named coordinates."""
    from nsmaps.reduced.conditions.text import text_of

    symbols = Symbols(names)
    by = [symbols.coordinate(column) for column in range(len(names))]
    return tuple(tuple(text_of(expression(text, names).diff(x), names) for x in by) for text in texts)


def expression(text: str, names: Sequence[str]) -> Any:
    """A formula in sympy, in real symbols of the named coordinates."""
    return fold_term(text, names, Symbols(names))


@lru_cache(maxsize=256)
def _evaluate(text: str, names: tuple[str, ...]) -> Evaluate:
    return fold_term(text, names, Numbers())


def sum_of_products(of: Sequence[Any], exponents: Ints, coefficients: Floats, centre: Floats, scale: Floats) -> Any:
    """A sum of Chebyshev products of scaled expressions in sympy: exact in plain powers, then each coefficient rounded once.

    Products T_k(cos(x)) and sin(x) T_k(cos(x)) become harmonics.
    """
    import sympy as sp
    from sympy.simplify.fu import TR8

    plain = [(c, s) == (0, 1) and isinstance(each, sp.cos) for each, c, s in zip(of, centre, scale, strict=True)]
    found: dict[Any, Any] = {}

    def factor(j: int, degree: int) -> Any:
        """One factor of a product, in place-holders that expansion leaves alone."""
        if plain[j]:
            return found.setdefault((j, degree), sp.Dummy(real=True))
        x = found.setdefault((j, 1), sp.Dummy(real=True))
        return sp.chebyshevt_poly(degree, (x - sp.Rational(float(centre[j]))) / sp.Rational(float(scale[j])))

    terms = [
        sp.Mul(sp.Rational(float(c)), *(factor(j, e) for j, e in enumerate(key) if e))
        for key, c in zip(exponents.tolist(), coefficients.tolist(), strict=True)
    ]
    places = {dummy: sp.cos(e * of[j].args[0]) if plain[j] else of[j] for (j, e), dummy in found.items()}
    total = sp.expand(sp.Add(*terms)).xreplace(places)
    total = sp.expand(TR8(total), trig=False, power_exp=False, power_base=False, log=False) if any(plain) else total
    return sp.Add(*(sp.Float(c, 17) * term for term, c in total.as_coefficients_dict().items()))
