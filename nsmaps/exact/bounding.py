"""Bounds on what a flight and its rates may be, over all times up to a horizon."""

from typing import Any

import sympy as sp

from nsmaps.exact.symbols import Flow, S, check_form


class Lesser(sp.Function):  # type: ignore[misc]
    """The lesser of two numbers; sympy's own would compare them, at length."""

    nargs = 2


Power = tuple[sp.Symbol, sp.Expr, sp.Expr | None]  # of an exponential: its symbol, rate and, where it is exp(a s) sinh(k s), k
Parts = list[tuple[tuple[int, ...], sp.Expr]]  # of an amplitude: powers of the sines, coefficient


def bound(flow: Flow, expr: sp.Expr, horizon: sp.Expr) -> sp.Expr:
    """A bound on |expr| for s in [0, horizon]: the lesser of those with exp(a s) sinh(k s) as a whole and as two exponentials."""
    whole = _bound(flow, expr, horizon, apart=False)
    return Lesser(whole, _bound(flow, expr, horizon, apart=True)) if flow.twins else whole


def along_phase(expr: sp.Expr, phase: sp.Symbol, period: sp.Expr) -> list[sp.Expr]:
    """An expression in the phase, its rate in time, and a bound on its second rate over a period of the forcing."""
    rate, flow = 2 * sp.pi / period, Flow()
    later = expr.subs(phase, rate * S)
    check_form(later)
    return [expr, rate * sp.diff(expr, phase), bound(flow, flow.rate(flow.rate(flow.split(later))), period)]


def _bound(flow: Flow, expr: sp.Expr, horizon: sp.Expr, apart: bool) -> sp.Expr:
    """See `bound`; sines and cosines of one frequency are collected into one amplitude."""
    powers: list[Power] = [(sp.Symbol(f"_exp{i}"), q.k, None) for i, q in enumerate(flow.growths)]
    sines = [sp.Symbol(f"_sin{i}") for i in range(len(flow.waves))]
    cosines = [sp.Symbol(f"_cos{i}") for i in range(len(flow.waves))]
    plain: dict[sp.Symbol, sp.Expr] = {}
    for w, sine, cosine in zip(flow.waves, sines, cosines, strict=True):
        plain |= {w.c: cosine - 1, w.n: sine, w.r: sine - flow.name(w.k) * S}
    for q, (power, _, _) in zip(flow.growths, powers, strict=True):
        plain |= {q.x: power - 1, q.e: power - 1 - flow.name(q.k) * S}
    for i, twin in enumerate(flow.twins):
        upper, low = powers[flow.growths.index(twin.upper)][0], sp.Symbol(f"_low{i}")
        sinh = (upper - low) / 2 if apart else low
        powers.append((low, twin.lower, None) if apart else (low, sp.Max(twin.upper.k, twin.lower), twin.k))
        plain |= {twin.n: sinh, twin.r: sinh - flow.name(twin.k) * S}
    poly = sp.Poly(sp.expand(expr.subs(plain)), S, *(symbol for symbol, _, _ in powers), *sines, *cosines)
    n, m = len(flow.waves), 1 + len(powers)
    amplitudes: dict[tuple[Any, ...], Parts] = {}
    for exponents, coefficient in poly.terms():
        trig = exponents[m:]
        key = (exponents[:m], trig.index(1) % n if sum(trig) == 1 else trig)
        amplitudes.setdefault(key, []).append((trig[:n], flow.restore(coefficient)))
    return sp.Add(*(_amplitude(flow, exponents, powers, parts, horizon) for (exponents, _), parts in amplitudes.items()))


def _amplitude(flow: Flow, exponents: tuple[int, ...], powers: list[Power], parts: Parts, horizon: sp.Expr) -> sp.Expr:
    """A bound on waves times s and exponentials to these powers, by |sin| <= 1 or, where that is less, |sin(k s)| <= k s.

    Likewise exp(a s) sinh(k s), for k of either sign, is at most exp(q s)/2 and k s exp(q s) with the greater rate q.
    """
    raised = [(rate, k, e) for (_, rate, k), e in zip(powers, exponents[1:], strict=True) if e]
    rate = sp.Add(*(rate * e for rate, _, e in raised))
    twins = [(k, e) for _, k, e in raised if k is not None]
    many = sum(e for _, e in twins)
    large = _largest(exponents[0], rate, horizon) * _length([c for _, c in parts]) / 2**many
    if not (twins or (raised and any(any(sines) for sines, _ in parts))):
        return large
    small = sp.S.Zero
    for sines, c in parts:
        ks = [k**e for k, e in [*((w.k, e) for w, e in zip(flow.waves, sines, strict=True)), *twins]]
        small += _largest(exponents[0] + sum(sines) + many, rate, horizon) * sp.Abs(sp.Mul(c, *ks))
    return Lesser(large, small)


def _largest(power: int, rate: sp.Expr, horizon: sp.Expr) -> sp.Expr:
    """The largest s**power exp(rate s) for s in [0, horizon]: at its maximum, s = -power/rate, if that comes before the end."""
    if power == 0:
        return sp.exp(sp.Max(0, rate) * horizon)
    s = power / sp.Max(-rate, power / horizon)
    return s**power * sp.exp(rate * s)


def _length(parts: list[sp.Expr]) -> sp.Expr:
    """The Euclidean length of the coefficients of sine and cosine."""
    if len(parts) == 1:
        return sp.Abs(parts[0])
    square = sum(part**2 for part in parts)
    if sp.count_ops(square) < 300:  # beyond that it would be written as a long sum, whose rounding counts
        square = sp.expand(square)
    if sp.count_ops(square) < 200:
        square = sp.factor(sp.trigsimp(square))
    return sp.sqrt(square)
