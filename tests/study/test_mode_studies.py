"""Studies of systems with modes: noise in their formulas, and families of words of any section."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from messages import message
from nsmaps_recoil_pair import RecoilPair

from nsmaps import Noise, load_study, noisy_orbits, read_result, run_study
from nsmaps.dynamics.noise.residence import residence
from nsmaps.errors import StudyError
from nsmaps.figures.longrun.noise import sheets

NOISE = """\
system: recoil_pair
parameters: {eta: 0.03, kappa: 0.04, Lambda: 0.2, d: 0.228, r: 0.25, g_bar: 0.122}
noise:
  sigma: [0, 0.02]
  tau: 0.5
  start: {v: 0.6736, X: -0.176, V: 0.161, phi: 0.414}
  n_returns: 60
  n_realisations: 3
  rng: 5
  modes: {"1:1": [BTB], "2:1": [BB, BTB]}
  impacts: {parameter: d, from: 0.225, to: 0.23, points: 2, sigma: 0.02, n_returns: 5, transient: 5}
figures: [noise]
"""
FAMILIES = """\
system: belt
parameters: {zeta: 0.02, vb: 0.5, mu_k: 0.4, mu_s: 0.6, A: 0.3, w: 1.3}
grid: {x: {from: 0.3, to: 0.9, points: 5}, phi: {from: 0, to: 6, points: 40}}
families: {both: [MKMKM], one: [MKM], other: [MPKM, MKPKM]}
"""


RELEASE = """
from nsmaps import PoincareSection
from nsmaps_belt import Belt


class Release(Belt):
    def section(self, t, y):
        return PoincareSection("M", ("phi",), states={"u": self.vb})
"""


def test_noise_in_a_study_is_that_of_the_function():
    Path("noise.yaml").write_text(NOISE)
    result = run_study("noise.yaml", out="noise")
    system = RecoilPair(eta=0.03, kappa=0.04, Lambda=0.2, d=0.228, r=0.25, g_bar=0.122)
    for sigma, stay in zip((0, 0.02), result.noise.stays, strict=True):
        made = noisy_orbits(
            system, [0.6736, -0.176, 0.161, 0.414], Noise(sigma=sigma, tau=0.5), n_returns=60, n_realisations=3, rng=5
        )
        known = residence(made.words, made.time, {"1:1": ["BTB"], "2:1": ["BB", "BTB"]}, 12)
        assert np.array_equal(stay.time, known.time)
        assert np.array_equal(stay.switches, known.switches)
    assert [diagram.walls for diagram in result.noise.impacts] == [("B", "T")] * 4
    again = read_result("noise")
    assert np.array_equal(again.noise.impacts[3].speed, result.noise.impacts[3].speed, equal_nan=True)
    (sheet,) = sheets(again.noise)
    drawn = [panel(Figure().add_subplot()) for panel in sheet.panels]
    assert all(ax.has_data() for ax in drawn[:3])


def test_families_hold_words_of_every_letter_of_the_section():
    Path("release.py").write_text(RELEASE)
    free = FAMILIES.replace("belt", "release.py:Release").replace("x: {from: 0.3, to: 0.9, points: 5}, ", "").replace("40", "400")
    Path("families.yaml").write_text(free)
    result = run_study("families.yaml", out="families")
    system, words = result.system, result.returns.words
    assert system.letters[0] == "K"  # the first of the class, with which no return begins
    assert system.section_letters == ("M",)
    sizes = {name: len(surface.returns) for name, surface in result.surfaces.items()}
    assert sizes["one"] == (words == "MKM").sum() > 0
    assert sizes["other"] == np.isin(words, ["MPKM", "MKPKM"]).sum() > 0
    twice = system.first_return(result.returns.image[words == "MKM"])
    assert sizes["both"] == (twice.words == "MKM").sum() > 0


@pytest.mark.parametrize("word", ["KM", "M"])
def test_words_that_are_no_returns_are_refused(word):
    Path("wrong.yaml").write_text(FAMILIES.replace("[MKMKM]", f"[{word}]"))
    with pytest.raises(StudyError, match=message("study.not-a-return", word=word, letters="'M' or 'P'")):
        run_study(load_study("wrong.yaml"), out="wrong")
