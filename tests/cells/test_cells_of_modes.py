"""Covers, closed sets, cycles, exit times and bounded domains of systems with modes."""

import numpy as np
import pytest
from nsmaps_belt import Belt
from nsmaps_buck_converter import BuckConverter
from nsmaps_rocking_block import RockingBlock
from nsmaps_soft_impact import SoftImpact
from nsmaps_two_masses import TwoMasses

import nsmaps
from nsmaps.cells.morse import forward_invariant_set, morse_sets
from nsmaps.cells.periodic_points import find_cycles
from nsmaps.cells.times import exit_times
from nsmaps.reduced.conditions.region import Box

DAMPED = SoftImpact(xi=0.05, e=0.3, a=0.7, beta=29, w=0.8)
PLANAR = {
    "soft_impact": (DAMPED, [[0.5, 0.95], [1.1, 1.55]]),
    "buck_converter": (BuckConverter(E=24), [[11.9, 12.15], [0.5, 0.7]]),
    "rocking_block": (RockingBlock(a=1.2, w=4, r=0.9), [[0.5, 0.75], [1.1, 1.7]]),
    "belt": (Belt(zeta=0.02, vb=0.2, mu_k=0.3, mu_s=0.5, w=1.3, A=0.25), [[0.33, 0.43], [1.7, 2.4]]),
}


@pytest.mark.parametrize("name", PLANAR)
def test_a_closed_set_around_the_fixed_point(name):
    """Orbits of states of its cells stay in it; it holds the attractor, and is small in the window."""
    made, window = PLANAR[name]
    cover = morse_sets(made, window, depth=4)
    assert cover.of == "exact map"
    (minimal,) = cover.minimal
    held = forward_invariant_set(made, cover, minimal)
    assert held.forward_invariant
    assert len(held.numbers) < 0.01 * cover.cells.size
    boxes = held.boxes
    rng = np.random.default_rng(1)
    states = boxes[rng.integers(0, len(boxes), 100)]
    states = made.on_section(states[:, :, 0] + rng.random(states.shape[:2]) * np.ptp(states, axis=2))
    states = states[held.contains(states)]
    assert len(states) > 50
    for _ in range(20):
        states = made.first_return(states).image
        assert held.contains(states).all()
    assert np.ptp(states, axis=0).max() < 1e-2


def test_behind_a_doubling_the_cover_separates_the_cycle_from_the_saddle():
    made, window = BuckConverter(E=28), [[12.0, 12.12], [0.51, 0.69]]
    cover = morse_sets(made, window, depth=6)
    found = find_cycles(made, window, max_period=2, depth=4)
    fixed, cycle = (each.states for each in found.cycles)
    assert len(cycle) == 2
    (minimal,) = cover.minimal
    held = forward_invariant_set(made, cover, minimal)
    assert held.forward_invariant
    assert held.contains(cycle).all()
    assert not held.contains(fixed).any()
    assert cover.contains(fixed).all()
    number = cover.numbers.tolist().index(int(cover.cells.numbers_of(fixed)[0]))
    assert cover.component[number] >= 0
    assert cover.component[number] != minimal


def test_a_box_that_the_exact_map_carries_into_itself():
    domain = nsmaps.attracting_domain(DAMPED, [[0.66, 0.77], [1.265, 1.375]], max_updates=1)
    assert domain.forward_invariant
    assert domain.claim == "enclosed for the exact map"
    states = domain.boxes[0][:, 0] + np.random.default_rng(2).random((200, 2)) * np.ptp(domain.boxes[0], axis=1)
    for _ in range(40):
        states = DAMPED.first_return(states).image
        assert ((domain.boxes[0][:, 0] <= states) & (states <= domain.boxes[0][:, 1])).all()
    assert ((domain.box[:, 0] <= states) & (states <= domain.box[:, 1])).all()


def test_exit_and_arrival_times():
    window = np.array([[0.66, 0.77], [1.265, 1.375]])
    cover = morse_sets(DAMPED, window, depth=2)
    held = forward_invariant_set(DAMPED, cover)
    assert held.forward_invariant
    times = exit_times(DAMPED, {"all": Box.of(DAMPED.coordinates, window)}, window, depth=2, n_cells=32, target=held)
    assert times.arrived is not None
    states = window[:, 0] + np.random.default_rng(3).random((300, 2)) * np.ptp(window, axis=1)
    steps = times.arrived[times.cells.numbers_of(states)]
    assert (steps >= 0).mean() > 0.9
    for k in range(steps.max() + 1):
        assert held.contains(states[(steps >= 0) & (steps <= k)]).all()
        states = DAMPED.first_return(states).image


def test_a_cover_in_four_coordinates():
    made = TwoMasses(w=1.4)
    orbit = nsmaps.periodic_orbit(made, [1.0122, -0.5611, -0.1012, 6.2183])
    assert orbit.converged
    window = np.stack([orbit.states[0] - 1e-3, orbit.states[0] + 1e-3], axis=-1)
    cover = morse_sets(made, window, depth=1, n_cells=4)
    assert cover.contains(orbit.states).all()
    assert len(cover.numbers) < 0.5 * cover.cells.size
