"""Reference values of piecewise-linear maps (tests/data/maps), and how cycles and exponents are compared with them."""

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

import nsmaps
from nsmaps.dynamics.search import periodic_orbits_by_word

DATA = Path(__file__).parent / "data" / "maps"


def rows(name: str) -> Any:
    """What one of the files holds; its numbers are texts, fractions p/q are exact."""
    return json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))


def number(text: str) -> float:
    return float(Fraction(text))


def numbers(values: dict[str, str]) -> dict[str, float]:
    return {name: number(value) for name, value in values.items()}


def cyclic(word: str) -> str:
    """A word from the letter on with which it is first in order."""
    return min(word[k:] + word[:k] for k in range(len(word)))


def check_cycles(system: nsmaps.PiecewiseMap, references: list[dict[str, Any]], max_period: int) -> None:
    """All cycles up to a period: words, points to 1e-13 of the motion's size, multipliers, trace, determinant, stability."""
    found = {cyclic(orbit.word): orbit for orbit in periodic_orbits_by_word(system, max_period)}
    assert sorted(found) == sorted(cyclic(each["word"]) for each in references)
    for each in references:
        orbit, word = found[cyclic(each["word"])], each["word"]
        start = next(k for k in range(len(word)) if orbit.word[k:] + orbit.word[:k] == word)
        point = np.array([number(text) for text in each["point"]])
        turned = np.roll(orbit.states, -start, axis=0)
        assert np.abs(turned[0] - point).max() <= 1e-13 * np.abs(orbit.states).max()
        exact = np.array([complex(number(real), number(imaginary)) for real, imaginary in each["multipliers"]])
        largest = np.abs(exact).max()
        assert max(np.abs(orbit.multipliers - one).min() for one in exact) <= 1e-12 * largest
        assert orbit.converged
        assert orbit.exists
        if "trace" in each:
            assert abs(np.trace(orbit.derivative) - number(each["trace"])) <= 1e-12 * largest
            assert abs(np.linalg.det(orbit.derivative) - number(each["det"])) <= 1e-12 * largest ** len(point)
            assert orbit.stable == each["stable"]


def check_exponents(system: nsmaps.PiecewiseMap, reference: dict[str, Any], returns: int = 500_000) -> None:
    """The exponents of a long orbit, and its share of R, within five standard errors of both runs."""
    start = np.full(len(system.coordinates), 0.1234567)
    found = nsmaps.lyapunov(system, starts=start, n_returns=returns)
    values, errors = (np.array([number(text) for text in reference[name]]) for name in ("values", "standard_errors"))
    assert (np.abs(found.exponents - values) <= 5 * np.hypot(found.error, errors)).all()
    assert found.error.max() < 2e-3
    share = (nsmaps.orbit(system, start, 20_000).words == "R").mean()
    assert abs(share - number(reference["share_of_R"])) < 0.03


def word_of(words: np.ndarray) -> str:
    """The letters of successive returns."""
    return "".join(words.tolist())
