"""Surfaces of sliding from which both modes lead away: the motion is not unique, which is an outcome of its own."""

import numpy as np
import pytest
import sympy as sp
from messages import message

from nsmaps import Guard, HybridSystem, Noise, PoincareSection, SlidingSurface, noisy_orbits
from nsmaps.errors import StateError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.trajectory import track


class Pushed(HybridSystem):
    """u' = sgn(u) + 2 cos t, kicked to u = 0 once a unit of time; the surface repels where 2 |cos t| < 1, else it is crossed."""

    states, noise = ("c", "u"), "noise"

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        force = 2 * sp.cos(t) + y.noise
        return {"above": {"c": 1, "u": 1 + force}, "below": {"c": 1, "u": force - 1}}

    def guards(self, t, y):
        return {
            "side": SlidingSurface("above", "below", y.u, letters={"above": "U", "below": "L", "side": "S"}),
            "K": Guard(("above", "below"), 1 - y.c, to="above", reset={"c": 0, "u": 0}),
            "H": Guard(("above", "below"), sp.Rational(1, 2) - y.c),
        }

    def section(self, t, y):
        return PoincareSection("K", ("u", "phi"))


class Half(Pushed):
    """The same seen half a unit of time after the kick."""

    def section(self, t, y):
        return PoincareSection("H", ("u", "phi"))


PHASES = np.linspace(0.02, 6.26, 64)
REPELS = abs(2 * np.cos(PHASES)) < 1


@pytest.mark.parametrize("count", [1, 64])
def test_a_start_on_the_repelling_part_is_an_outcome_of_its_own(count):
    system, rows = Pushed(), np.column_stack([np.full(64, 0.3), PHASES])
    parts = [system.first_return(rows[k : k + count]) for k in range(0, 64, count)]
    outcome = np.concatenate([part.outcome for part in parts])
    assert ((outcome == Outcome.repelling) == REPELS).all()
    assert 10 < REPELS.sum() < 54
    image = np.concatenate([part.image for part in parts])
    assert np.isnan(image[REPELS]).all()
    assert np.isfinite(image[~REPELS]).all()
    assert not np.concatenate([part.certified for part in parts])[REPELS].any()
    assert "is not unique" in Outcome.repelling.advice


def test_an_event_that_leads_there_ends_the_return_when_it_does():
    system, rows = Half(), np.column_stack([np.full(64, 0.3), PHASES])
    returns = system.first_return(rows)
    kicked = abs(2 * np.cos(PHASES + 0.5)) < 1
    assert ((returns.outcome == Outcome.repelling) == kicked).all()
    alone = np.array([system.first_return(row[None]).outcome[0] for row in rows])
    assert (alone == returns.outcome).all()
    np.testing.assert_allclose(returns.time[kicked], 0.5, rtol=1e-14)
    (reason,) = system.reasons(rows[kicked][:1])
    assert "the sliding 'side', 'above' and 'below', lead away from its surface, 0.5 after the start, at c = 0, u = 0" in reason
    made = track(system, rows[kicked][0], 4, n_samples=5)
    assert made.events.name.tolist()[-1] == "K"


def test_near_to_the_surface_each_side_has_its_own_motion():
    system, phi = Pushed(), np.pi / 2
    both = system.arrivals([[0.0, 1e-9, phi], [0.0, -1e-9, phi], [0.0, 0.0, phi], [0.0, 0.0, 0.1]])
    assert both.outcome.tolist()[:3] == [Outcome.returned, Outcome.returned, Outcome.repelling]
    assert both.mode.tolist()[:3] == ["above", "below", ""]
    assert both.image[0, 0] > 0 > both.image[1, 0]
    for mode in ("above", "below", "side"):
        assert system.arrivals([[0.0, 0.0, phi]], mode).outcome.tolist() == [Outcome.repelling]


def test_noise_meets_it_too():
    made = noisy_orbits(Pushed(), [0.3, 0.1], Noise(sigma=0.1, tau=0.5), n_returns=20, n_realisations=4)
    assert made.ended() == {"repelling": 4}


def test_states_in_sliding_lie_on_its_surface():
    with pytest.raises(StateError, match=message("exact.off-surface", state="0, 0.25", mode="side", distance=0.25)):
        Pushed().arrivals([[0.0, 0.25, 1.0]], "side")


@pytest.mark.parametrize("system", [Pushed(), Half()], ids=["start", "event"])
def test_boxes_of_states_know_that_some_have_no_image(system):
    boxes = np.array([[[0.2, 0.21], [phi, phi + 0.01]] for phi in PHASES])
    found = system.image_boxes(boxes)
    corners = np.array([system.first_return([[u, phi] for u in box[0] for phi in box[1]]).valid for box in boxes])
    assert found.empty[~corners.all(axis=1)].all()
    assert not found.empty[corners.all(axis=1)].all()
    assert 5 < corners.all(axis=1).sum() < 59
