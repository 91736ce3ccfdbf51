"""Wrong parameters: one error of nsmaps wherever a system is made, with a near match whatever the case."""

import pytest

import nsmaps
from nsmaps.errors import ParameterError, near_match

PAIR = {"d": 0.35, "g_bar": 0.2113}


@pytest.mark.parametrize(
    ("parameters", "says"),
    [
        (PAIR | {"R": 1}, "unknown parameter 'R'; expected: d, r, g_bar, M, F, g, beta, s, omega, did you mean 'r'?"),
        (PAIR | {"g_baz": 1}, "did you mean 'g_bar'?"),
        ({"d": 0.35}, "the parameter 'g_bar' is missing"),
        ({"D": 0.35, "g_bar": 0.2}, "unknown parameter 'D'"),
        (PAIR | {"r": 2}, "r is 2; expected: less than or equal to 1"),
        (PAIR | {"M": 1}, "M given but not used"),
    ],
)
def test_a_wrong_parameter_is_an_error_of_nsmaps_without_a_link(parameters: dict[str, float], says: str) -> None:
    with pytest.raises(ParameterError) as told:
        nsmaps.load_system("vi_pair", **parameters)
    assert str(told.value).startswith("VIPair: ")
    assert says in str(told.value)
    assert "http" not in str(told.value)
    assert isinstance(told.value, ValueError)


def test_a_missing_parameter_that_is_there_misspelt_is_told_once() -> None:
    with pytest.raises(ParameterError) as told:
        nsmaps.load_system("vi_pair", D=0.35, g_bar=0.2)
    assert "missing" not in str(told.value)


def test_changing_a_parameter_says_the_same() -> None:
    system = nsmaps.load_system("vi_pair", **PAIR)
    with pytest.raises(ParameterError, match=r"VIPair: unknown parameter 'G_bar'; .* did you mean 'g_bar'\?"):
        system.at(G_bar=1)
    with pytest.raises(ParameterError, match="r is -1; expected: greater than or equal to 0"):
        system.at(r=-1)


def test_near_matches_do_not_mind_the_case() -> None:
    assert near_match("l", ["a", "L"]) == ", did you mean 'L'?"
    assert near_match("R1", ["R1", "r2"]) == ", did you mean 'R1'?"
    assert near_match("x", ["L"]) == ""
