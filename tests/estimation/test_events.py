"""Times and states of events and their derivatives, against the engine of closed forms and against formulas."""

from typing import Any

import numpy as np
from nsmaps_vi_pair import VIPair
from unforced import Drop

from nsmaps.estimation.shooting.event_map import EventModel

PAIR = VIPair(d=0.35, r=0.5, g_bar=0.2113)


def events(values: list[float], start: list[float], offset: float = 0.3, n: int = 6) -> Any:
    model = EventModel(PAIR, ["r", "d"])
    return model.at(values).events(np.array([start]), np.array([offset]), n)


def test_times_walls_and_speeds_are_those_of_the_closed_forms() -> None:
    model = EventModel(PAIR, ["r", "d"])
    found = model.at([0.5, 0.35]).events(np.array([[0.8, 0.2]]), np.array([0.3]), 9)
    hits = PAIR.impacts([0.8, np.pi * 0.2 + 0.3], 9)
    np.testing.assert_allclose(found.time[0] - 0.2, hits.time, rtol=1e-12)
    assert [model.letters[k] for k in found.letter[0]] == [hits.walls[k] for k in hits.wall]
    speeds, _ = model.at([0.5, 0.35]).speeds(found.letter[0], found.states[0], found.states_by[0])
    np.testing.assert_allclose(speeds, hits.speed, rtol=1e-12)


def test_derivatives_are_those_of_differences_of_the_closed_forms() -> None:
    found, h = events([0.5, 0.35], [0.8, 0.2], n=7), 1e-6

    def times(v: float, t: float, r: float, d: float, offset: float) -> np.ndarray:
        return t + PAIR.at(r=r, d=d).impacts([v, np.pi * t + offset], 7).time

    at = np.array([0.8, 0.2, 0.5, 0.35, 0.3])
    for k, step in enumerate(h * np.eye(5)):
        difference = (times(*(at + step)) - times(*(at - step))) / (2 * h)
        np.testing.assert_allclose(found.time_by[0, :, k], difference, rtol=1e-6, atol=1e-6)


def test_a_ball_without_forcing_has_the_times_and_derivatives_of_its_formula() -> None:
    g, e, v, t = 9.81, 0.8, -3.0, 0.25
    ball = EventModel(Drop(g=g, e=e), ["g", "e"]).at([g, e])
    found = ball.events(np.array([[v, t]]), np.zeros(1), 4)
    k = np.arange(4)
    flights = np.array([sum(2 * e ** (j + 1) for j in range(n)) for n in k])
    by_e = np.array([sum(2 * (j + 1) * e**j for j in range(n)) for n in k])
    np.testing.assert_allclose(found.time[0], t - v * flights / g, rtol=1e-13)
    expected = np.array([-flights / g, np.ones(4), v * flights / g**2, -v * by_e / g]).T
    np.testing.assert_allclose(found.time_by[0, :, :4], expected, rtol=1e-12, atol=1e-14)
    speeds, by = ball.speeds(found.letter[0], found.states[0], found.states_by[0])
    np.testing.assert_allclose(speeds, -v * e**k, rtol=1e-13)
    np.testing.assert_allclose(by[:, 3], -v * k * e ** (k - 1.0), rtol=1e-12, atol=1e-14)
    states, by = ball.instants(found, (np.zeros(1, int), np.ones(1, int)), found.time[0, 1] + np.array([0.1]))
    u = -v * e**2
    np.testing.assert_allclose(states, [[u * 0.1 - g * 0.01 / 2, u - g * 0.1]], rtol=1e-12)
    late = -v * 2 / g  # d time of the event / d e, by which the sample is that much earlier in its flight
    np.testing.assert_allclose(by[0, 1, 3], -2 * v * e + g * late, rtol=1e-12)


def test_an_instant_after_another_event_has_no_state() -> None:
    found = events([0.5, 0.35], [0.8, 0.2])
    model = EventModel(PAIR, ["r", "d"]).at([0.5, 0.35])
    states, _ = model.instants(found, (np.zeros(1, int), np.ones(1, int)), found.time[0, 3:4])
    assert np.isnan(states).all()
