"""Words and images of random returns of systems with modes are those of a plain integrator, which shares only their formulas."""

import numpy as np
import pytest
from hybrid import SYSTEMS, numbers, reference, system
from words import judged, others


@pytest.mark.parametrize("name", SYSTEMS)
def test_words_are_those_of_an_integrator(name):
    given = reference(name)
    key, parameters = list(given["parameters"].items())[-1]
    rows = np.array([numbers(row["start"]) for row in given["returns"] if row["params"] == key])
    starts, found, words, off = judged(system(name, parameters), rows, 100)
    assert len(starts) > 70
    assert [(words[k], found.words[k]) for k in others(words, found.words)] == []
    assert np.median(off) < 1e-6
