"""Several returns in a row read as one, and families of such rows."""

import numpy as np
import pytest
from messages import message
from pydantic import ValidationError

import nsmaps
from nsmaps import Axis, Grid, WordFamily
from nsmaps.exact.surfaces.compose import compose_returns

GRID = Grid(axes={"v": Axis(low=0.02, high=0.9, points=60), "phi": Axis(low=0.0, high=6.2, points=50)})
M = {"M": 0.1245, "g": 9.8, "F": 5.0}


@pytest.fixture(scope="module")
def harvester() -> nsmaps.ImpactSystem:
    """The setting of the paper's last figure, where 2:1 motion attracts."""
    return nsmaps.load_system("vi_pair", d=0.21, r=0.25, beta=np.pi / 6, **M)


def test_two_returns_as_one(harvester: nsmaps.ImpactSystem) -> None:
    states = GRID.states()
    first = harvester.first_return(states, derivative=True, margin=True)
    first = first.select(first.valid)
    second = harvester.first_return(first.image, derivative=True, margin=True)
    both = compose_returns(first, second)
    assert both.words.tolist() == [a + b[1:] for a, b in zip(first.words.tolist(), second.words.tolist(), strict=True)]
    assert np.array_equal(both.start, first.start)
    assert np.array_equal(both.image, second.image, equal_nan=True)
    np.testing.assert_allclose(both.time, first.time + second.time)
    assert np.array_equal(both.margin.slowest, np.minimum(first.margin.slowest, second.margin.slowest))
    phase = first.start[:, 1] + harvester.phase_rate() * both.time
    np.testing.assert_allclose(both.lifted[both.valid, 1], phase[both.valid], rtol=1e-12, atol=1e-10)
    calm = both.valid & (both.margin.slowest > 0.05) & (both.margin.clearance > 1e-3)
    step = 1e-6
    for k in range(2):
        ends = [harvester.first_return(harvester.first_return(both.start + s * np.eye(2)[k]).image).image for s in (step, -step)]
        slope = (ends[0] - ends[1])[calm] / (2 * step)
        np.testing.assert_allclose(both.derivative[calm][:, :, k], slope, rtol=1e-4, atol=1e-5)


def test_a_word_longer_than_its_code_says_so(harvester: nsmaps.ImpactSystem) -> None:
    returns = harvester.first_return([[0.5, 1.0]])
    row = returns
    for _ in range(30):
        row = compose_returns(row, harvester.first_return(row.image))
    assert row.words[0].endswith("...")
    assert len(row.words[0]) == 26 + 3


def test_the_members_are_the_shortest_rows_that_match(harvester: nsmaps.ImpactSystem) -> None:
    """Against orbits read word by word."""
    surface = WordFamily(name="2:1", words=("B+TB",), max_returns=4).surface(harvester, GRID)
    states = GRID.states()
    words = nsmaps.orbit(harvester, states, 4).words
    expected = []
    for row in words.T.tolist():
        joint, hit = "", 0
        for k, word in enumerate(row, 1):
            if not word:
                break
            joint = joint + word[1:] if joint else word
            if joint.strip("B") == "T" and joint.endswith("TB") and not joint.endswith("TBB"):
                hit = k
                break
        expected.append(hit)
    expected = np.array(expected)
    assert np.array_equal(surface.member, expected > 0)
    assert {1, 2} <= set(expected.tolist())
    ends = nsmaps.orbit(harvester, states, 4).states
    there = np.flatnonzero(expected)
    assert np.array_equal(surface.image, ends[expected[there], there])


def test_families_of_the_paper(harvester: nsmaps.ImpactSystem) -> None:
    """BTTB is one return, BBTB and BTBB two in a row; every member makes its word."""
    words = nsmaps.orbit(harvester, GRID.states(), 2).words
    rows = np.array([a + b[1:] if a and b else "" for a, b in words.T.tolist()])
    for word in ("BBTB", "BTBB"):
        family = WordFamily(name=word, words=(word,))
        assert family.max_returns == 2
        surface = family.surface(harvester, GRID)
        assert np.array_equal(surface.member, rows == word)
        assert surface.member.any()
    fast = Grid(axes={"v": Axis(low=1.0, high=3.0, points=60), "phi": Axis(low=0.0, high=6.2, points=50)})
    family = WordFamily(name="BTTB", words=("BTTB",))
    assert family.max_returns == 1
    surface = family.surface(nsmaps.load_system("vi_pair", d=0.35, beta=np.pi / 3, **M), fast)
    assert surface.member.any()
    assert set(surface.returns.words.tolist()) == {"BTTB"}


def test_two_to_one_motion_is_a_fixed_point_of_its_family(harvester: nsmaps.ImpactSystem) -> None:
    states = nsmaps.orbit(harvester, [0.6, 0.3], 400).states[-2:]
    words = harvester.first_return(states).words.tolist()
    state = states[words.index("BB")]
    axes = {name: Axis(low=x, high=x + 1e-3, points=2) for name, x in zip(("v", "phi"), state, strict=True)}
    surface = WordFamily(name="2:1", words=("BBTB",)).surface(harvester, Grid(axes=axes))
    np.testing.assert_allclose(surface.image[0], state, atol=1e-9)


@pytest.mark.parametrize(
    ("words", "said"),
    [(("B(TB",), message("exact.pattern")), ((), message("others.too-few", number=1)), (("",), message("exact.not-a-word"))],
)
def test_what_is_no_pattern_is_refused(words: tuple[str, ...], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        WordFamily(name="x", words=words)


def test_a_letter_that_is_no_wall_is_named(harvester: nsmaps.ImpactSystem) -> None:
    with pytest.raises(nsmaps.NsmapsError, match=message("exact.letter", letter="X")):
        WordFamily(name="x", words=("B+X",)).surface(harvester, GRID)
