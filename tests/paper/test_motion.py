"""The studies that draw the motion and the state space, by what the paper says of their figures."""

from pathlib import Path

import numpy as np
import pytest

import nsmaps
from nsmaps.reduced.fit.filter import near_diagonal, own_slopes
from nsmaps.study.pictures.draw import draw


@pytest.fixture(scope="module")
def motion(tmp_path_factory):
    """The study of the motion as it was run, and as it reads back."""
    folder = tmp_path_factory.mktemp("run")
    return nsmaps.run_study("vi_pair/motion", folder), nsmaps.read_result(folder)


def test_what_is_kept_of_the_motion_reads_back(motion):
    made, read = motion
    for name in ("time", "displacement", "velocity", "ball", "walls", "sides", "at"):
        assert np.array_equal(getattr(made.orbits[0].track, name), getattr(read.orbits[0].track, name))
    assert np.array_equal(made.orbits[0].track.impacts.phase, read.orbits[0].track.impacts.phase)
    assert read.slices[0].along == "v"
    assert read.slices[0].at == {"phi": 0.4}
    assert np.array_equal(made.slices[0].jump, read.slices[0].jump)
    assert np.array_equal(made.slices[0].returns.image, read.slices[0].returns.image)


def test_the_orbit_is_that_of_the_impacts(motion):
    """Every impact on B of the track is a state of the orbit; the velocity changes sign from wall to wall (fig. model:abc)."""
    pair = motion[1].orbits[0]
    track = pair.track
    on_base = track.impacts.wall == 0
    states = np.column_stack([track.rates, track.impacts.phase])[on_base]
    assert states == pytest.approx(pair.exact.states[: len(states)], abs=1e-12)
    assert (track.rates[on_base] > 0).all()
    assert (track.rates[~on_base] < 0).all()


def test_a_run_draws_them(motion, tmp_path):
    result = motion[1]
    paths = draw(result, result.study.figures, tmp_path, dpi=40)
    assert [path.stem for path in paths] == ["sketch", "algorithm", "motion", "impacts", "slices"]
    assert all(Path(path).stat().st_size > 2000 for path in paths)


def test_bttb_is_fast_and_beside_phase_zero():
    """Fig. ICPP02pi: at v <= 1 and phi <= pi there is BB and BTB alone, and above pi mostly BB at first."""
    returns = nsmaps.run_study("vi_pair/window").returns
    v, phi = returns.start.T
    words = returns.words
    assert set(words[(v <= 1) & (phi <= np.pi)]) == {"BB", "BTB"}
    assert (words == "BTTB").any()
    assert v[words == "BTTB"].min() > 1
    assert np.mean(words[(v <= 1) & (phi > np.pi)] == "BB") > 0.7


def test_stars_are_where_the_paper_has_them():
    """Fig. 2Dpi-2pi: BTB is near both gently for phi < pi/2, steeply beyond, never from pi on; fig. 2D0-2pi: BB is steep."""
    result = nsmaps.run_study("vi_pair/projections")
    assert result.diagonal.slope == 2
    found = {}
    for name, surface in result.surfaces.items():
        near = near_diagonal(surface.returns, 1.2)
        gentle = (np.abs(own_slopes(surface)) <= 2).all(axis=1)
        found[name] = surface.start[near & gentle, 1], surface.start[near & ~gentle, 1]
    gentle, steep = found["BTB"]
    assert gentle.max() < np.pi / 2
    beyond = steep[steep > np.pi / 2]
    assert len(beyond)
    assert steep.max() <= np.pi
    gentle, steep = found["BB"]
    assert not (gentle < np.pi).any()
    assert (steep < np.pi).any()
