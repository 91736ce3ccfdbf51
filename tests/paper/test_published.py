"""The printed coefficients, evaluated exactly: what each map gives, what the text says, what the exact map gives."""

import json
from fractions import Fraction

import nsmaps_vi_pair.published as published
import numpy as np
import pytest
from messages import message
from nsmaps_vi_pair.published import REGIONS, published_map
from scipy.optimize import fsolve

import nsmaps
from nsmaps.errors import FitError

#: region, state at d = 0.35, what the printed map gives, what appendix NaviFig13 says, what the exact map gives
TABLE = [
    ("R1", (0.843, 0.298), (0.809, 0.383), (0.844, 0.396), (0.84395, 0.39413)),
    ("R2", (0.799, 1.150), (0.817, 0.290), (0.843, 0.298), (0.75780, 0.23712)),
    ("R3", (0.2, 0.1), (0.0931, 0.6391), (0.093, 2.116), (0.09446, 0.63945)),
    ("R4", (0.093, 2.116), (1.04, 8.65), (0.799, 1.150), (0.8186, 1.3879)),
]


def exactly(region, d, state):
    """A printed map by Fractions of its decimals alone."""
    printed = json.loads(published.FILE.read_text())[region]
    values = {"v": Fraction(repr(state[0])), "phi": Fraction(repr(state[1])), "1": Fraction(1)}
    image = {}
    for output, terms in printed["images"].items():
        total = Fraction(0)
        for text, coefficient in terms.items():
            powers = coefficient if isinstance(coefficient, list) else [coefficient]
            term = sum(Fraction(repr(c)) * Fraction(repr(d)) ** k for k, c in enumerate(powers))
            for factor in text.replace("**", "^").split("*"):
                name, _, power = factor.partition("^")
                term *= values[name] ** int(power or 1)
            total += term
        image[output] = float(abs(total) if output in printed.get("absolute", ()) else total)
    return [image["v"], image["phi"]]


@pytest.mark.parametrize(("region", "state", "printed", "text", "exact"), TABLE, ids=[row[0] for row in TABLE])
def test_table_of_the_printed_coefficients(pair, region, state, printed, text, exact):
    found = published_map(region, 0.35)([state])[0]
    assert found == pytest.approx(exactly(region, 0.35, state), rel=1e-12)
    assert found == pytest.approx(printed, rel=6e-3)
    assert pair(0.35).first_return([state]).image[0] == pytest.approx(exact, abs=6e-5)
    assert np.abs(found - text).max() > 0.01  # none of them gives what the text says


@pytest.mark.parametrize("region", REGIONS)
@pytest.mark.parametrize("d", [0.26, 0.3, 0.35])
def test_printed_maps_keep_all_digits_over_their_region(region, d):
    polymap = published_map(region, d)
    for state in np.random.default_rng(0).uniform(polymap.domain[:, 0], polymap.domain[:, 1], (20, 2)).round(6).tolist():
        size = [np.abs(c).sum() for c in polymap.coefficients]
        assert (np.abs(polymap([state])[0] - exactly(region, d, state)) < 1e-13 * np.array(size)).all()


def test_the_printed_r1_has_an_unstable_fixed_point():
    polymap = published_map("R1", 0.35)
    fixed = fsolve(lambda x: polymap([x])[0] - x, [0.8, 0.37])
    assert fixed == pytest.approx([0.805, 0.372], abs=6e-4)
    assert np.linalg.eigvals(polymap.derivative([fixed])[0]).real.min() == pytest.approx(-1.086, abs=6e-4)


def test_the_printed_r5_has_no_velocities():
    """Coefficients b50 and b51: nearly all of the region goes to speeds beyond 10, up to 1e6."""
    polymap = published_map("R5", 0.35)
    speeds = polymap(np.column_stack([np.linspace(0.05, 0.55, 101), np.full(101, 2.8)]))[:, 0]
    assert speeds.min() > 500
    assert 1e6 < speeds.max() < 2e6


def test_the_data_are_complete():
    maps = json.loads(published.FILE.read_text())
    counts = {name: [len(terms) for terms in maps[name]["images"].values()] for name in REGIONS}
    assert counts == {"R1": [9, 9], "R2": [6, 6], "R3": [18, 20], "R4": [9, 5], "R5": [5, 4]}
    assert maps["R4"]["images"]["v"]["v**8"] == [-251148526, 3431234055, -17535685854, 39732483684, -33678323446]
    assert maps["R3"]["images"]["phi"]["1"] == -4.708e-05
    assert list(maps["R1"]["images"]["v"]) == ["1", "phi", "v", "phi**2", "phi*v", "v**2", "phi**2*v", "phi*v**2", "v**3"]
    with pytest.raises(FitError, match=message("errors.printed", name="R6")):
        published_map("R6", 0.3)


def test_study_published():
    result = nsmaps.run_study(nsmaps.load_study("vi_pair/published"))
    for name in REGIONS:
        states = result.composite.piece(name).map.domain.mean(axis=1)[None]
        np.testing.assert_array_equal(result.composite.piece(name).map(states), published_map(name, 0.35)(states))
    assert list(result.composite.first_return([[0.8, 0.3], [0.2, 0.1], [0.8, 3.5]]).words) == ["BTB", "BB", ""]
    verdicts = {(v.name, v.of): v.holds for v in result.verdicts}
    assert verdicts["orbit from (v = 0.2, phi = 0.1): completes all returns", "composite map"] is False  # it leaves all regions
    assert verdicts["orbit from (v = 0.2, phi = 0.1): completes all returns", "exact map"] is True
    away = np.abs(result.orbits[0].composite.states[-21:] - [0.80547, 0.37246]).max(axis=1)
    assert away[-1] > 2 * away[0]  # its R1 drives away from its own fixed point
