"""The first zero of a function of time in mpmath, proved by a bound on its second derivative; no code of nsmaps."""

import mpmath as mp

BISECTIONS, NEWTON = 20, 8


def falls(function, bend, low, high):
    """The first time between two at which a function falls through zero, or None; at the lower one it is not negative.

    `function(s)` is its value and rate, `bend(s)` a bound on its second derivative from s on. An interval is passed over if the
    bound keeps the function positive, or if it is monotone there and positive at the end; otherwise it is halved.
    """
    middle, half = (low + high) / 2, (high - low) / 2
    value, rate = function(middle)
    most = bend(low)
    if value - abs(rate) * half - most * half**2 / 2 > 0:
        return None
    if abs(rate) > most * half:
        return root(function, low, high) if rate < 0 and function(high)[0] < 0 else None
    found = falls(function, bend, low, middle)
    return found if found is not None else falls(function, bend, middle, high)


def root(function, low, high):
    """The zero of a function that falls between two times, by bisection and then Newton's method."""
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if function(middle)[0] < 0 else (middle, high)
    s = (low + high) / 2
    for _ in range(NEWTON):
        value, rate = function(s)
        s -= value / rate
    assert low <= s <= high
    return s


def first(functions, bend, step, most=10_000):
    """The first zero of several functions by name, (time, name), looked for in intervals of this length."""
    for k in range(most):
        low, high = k * mp.mpf(step), (k + 1) * mp.mpf(step)
        found = [(s, name) for name, function in functions.items() if (s := falls(function, bend, low, high)) is not None]
        if found:
            return min(found)
    raise ValueError(f"no event in {most} intervals of {step}")
