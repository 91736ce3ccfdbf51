"""What is shown of results, systems and signatures: nothing unfolded, no array."""

import inspect
import pydoc

import numpy as np
import pytest

import nsmaps
from nsmaps.arrays import ArrayLike, brief
from nsmaps.exact.returns import Returns

STATES = [[0.43, 0.26], [0.2, 0.1], [np.nan, 0.0]]


@pytest.mark.parametrize("name", [name for name in nsmaps.__all__ if callable(getattr(nsmaps, name))])
def test_help_shows_what_is_like_an_array_by_its_name(name):
    text = pydoc.plain(pydoc.render_doc(getattr(nsmaps, name)))
    assert "_SupportsArray" not in text
    assert "_NestedSequence" not in text


def test_the_name_is_seen_where_it_is_meant():
    assert inspect.signature(nsmaps.exact.ReturnMap.first_return).parameters["states"].annotation is ArrayLike
    assert "starts: Union[ArrayLike, " in pydoc.plain(pydoc.render_doc(nsmaps.orbit)).replace("ArrayLike | ", "Union[ArrayLike, ")


def test_a_system_is_printed_with_its_class(pair):
    system = pair(0.35)
    assert str(system) == repr(system)
    assert str(system).startswith("VIPair(d=0.35, r=0.5, ")


def test_returns_are_printed_as_a_line(pair):
    returns = pair(0.35).first_return(STATES)
    assert str(returns) == "3 first returns of (v, phi): 2 returned, 1 invalid; words: BB 2"
    assert str(returns.select(np.zeros(3, bool))) == "0 first returns of (v, phi): none; words: none"
    assert repr(returns) == f"Returns({returns})"


def test_results_are_printed_without_their_arrays(pair):
    system = pair(0.35)
    orbit = nsmaps.orbit(system, [0.2, 0.1], 3000)
    domain = nsmaps.attracting_domain(system, [[0.7, 1.0], [0.2, 1.14]], max_updates=1, bounds_kind="sampled", n_samples=21)
    for result in (orbit, domain, system.impacts([0.2, 0.1], 2000), nsmaps.periodic_orbit(system, [0.83, 0.36])):
        assert "array([" not in repr(result) + str(result)
        assert max(len(repr(result)), len(str(result))) < 700
        assert repr(result).startswith(f"{type(result).__name__}(")
    assert "exact map" in str(domain)


def test_what_is_no_array_is_shown():
    returns = Returns(("v",), ("B",), *np.zeros((3, 0, 1)), *np.zeros((3, 0)))
    assert "derivative=None, margin=None, fitted=False, integrated=False, alphabet=<Alphabet>, number=None)" in brief(returns)


def test_few_numbers_are_shown():
    mean = nsmaps.observe(
        nsmaps.load_system("bouncing_ball", Gamma=1.2), [4.2, 0.4], [{"name": "one", "formula": "1"}], n_returns=64
    )
    assert repr(mean.per_return) == "Mean(value=[1.], error=[0.])"
