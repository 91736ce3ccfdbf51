"""The studies that the bouncing ball and the impact oscillator ship, run by their names."""

import numpy as np
import pytest

import nsmaps
from nsmaps.plugins import study_files

DOUBLES = np.hypot(np.pi / 3, 2 * 1.25 / 1.5**2)


def test_both_systems_ship_studies():
    assert set(study_files("bouncing_ball")) == {"auto", "doubling", "proof", "proof-chaos", "proof-rest"}
    assert set(study_files("impact_oscillator")) == {"auto", "grazing", "proof", "seam"}


@pytest.mark.thorough
def test_the_balls_diagram_doubles_where_the_closed_form_says(shipped):
    made = nsmaps.read_result(shipped("bouncing_ball/doubling")).bifurcation_diagram["exact"]
    single = made.values[made.labels[:, 0] == "1:0/T"]
    double = made.values[made.labels[:, 0] == "1:0/2T"]
    assert single.max() <= DOUBLES + 0.002 <= double.min() + 0.01
    locked = made.values[(made.states[:, 0, :, 0] < 1e-9).any(axis=1)]
    assert locked.min() == pytest.approx(1.762, abs=0.003)


@pytest.mark.thorough
def test_an_attractor_beside_the_ends_of_the_circle_is_in_one_box():
    """The box lies across phase zero, and orbits of the composite map end where those of the exact one do."""
    result = nsmaps.run_study("impact_oscillator/seam")
    assert result.holds
    exact = nsmaps.periodic_orbit(result.system, [0.98, 6.26]).states[0]
    assert exact[1] > 6.2
    made = nsmaps.orbit(result.composite, [[1.0, 0.5], [0.2, 3.0], [2.0, 6.0]], 200).final
    assert made == pytest.approx(np.tile(exact, (3, 1)), abs=2e-3)
    attracting = [piece for piece in result.composite.pieces if piece.name in result.partition.attracting]
    for phase in (6.28, 0.003):
        assert any(piece.region.contains([[exact[0], phase]])[0] for piece in attracting)


@pytest.mark.thorough
def test_the_oscillators_diagram_is_chaotic_at_the_graze(shipped):
    made = nsmaps.read_result(shipped("impact_oscillator/grazing")).bifurcation_diagram["exact"]
    assert set(made.labels[made.values > 0.34754, 0]) == {"1:0/2T"}
    assert set(made.labels[made.values < 0.3469, 0]) == {"1:0/C"}


@pytest.fixture(scope="module", params=["bouncing_ball", pytest.param("impact_oscillator", marks=pytest.mark.thorough)])
def by_itself(request):
    """What the general algorithm makes of a system."""
    return nsmaps.run_study(f"{request.param}/auto")


def test_the_algorithm_by_itself(by_itself):
    assert by_itself.holds
    required = {verdict.name for verdict in by_itself.verdicts if verdict.required}
    assert {"covered", "domain exact: forward invariant", "domain exact: converged"} <= required


@pytest.mark.parametrize("by_itself", ["bouncing_ball"], indirect=True)
def test_the_composite_map_of_the_ball_goes_round_the_locked_cycle(by_itself):
    """Through the first impact after the release, which leaves the table at the phase arcsin(1/Gamma) without speed."""
    released = by_itself.system.first_return([[0.0, np.arcsin(1 / 1.4)]]).image[0]
    orbit = nsmaps.orbit(by_itself.composite, [2.0, 3.0], 240)
    nearest = np.abs(orbit.states[-20:] - released).max(axis=1).min()
    assert nearest < 1e-2
