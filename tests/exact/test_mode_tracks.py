"""The motion of systems with modes between events, in slip, sliding and contact, against matrix exponentials of 30 digits."""

import mpmath as mp
import numpy as np
import pytest
from digits import number
from flint import arb_mat, ctx
from hybrid import StrobedFriction
from messages import message
from nsmaps_belt import Belt
from nsmaps_buck_converter import BuckConverter
from nsmaps_recoil_pair import RecoilPair
from nsmaps_rocking_block import RockingBlock

import nsmaps
from nsmaps.errors import StateError
from nsmaps.exact.trajectory import track

DIGITS, ROUNDING = 30, 1e-14
BELT = {"zeta": 0.02, "vb": 0.3, "mu_k": 0.4, "mu_s": 0.6, "w": 0.9, "A": 0.25}
PAIR = {"eta": 0.1, "kappa": 0.04, "Lambda": 0.2, "d": 0.35, "r": 0.5, "g_bar": 0.2113}


def belt(force):
    """Rates of a mass on the belt in slip with this friction, by the states and the forcing's cosine."""
    zeta, A = (mp.mpf(BELT[name]) for name in ("zeta", "A"))
    return lambda y, c: [y[1], A * c - 2 * zeta * y[1] - y[0] + force]


def friction(force):
    """The same of `StrobedFriction`."""
    return lambda y, c: [y[1], c / 2 - y[1] / 20 - 3 * y[0] + force]


def pair(free):
    """Rates of ball and capsule, free or together: one mass then, (1 + eta) X'' = cos(pi t) - kappa X - Lambda X' - eta g."""
    eta, kappa, damping, g = (mp.mpf(PAIR[name]) for name in ("eta", "kappa", "Lambda", "g_bar"))

    def rates(y, c):
        capsule = c - kappa * y[2] - damping * y[3]
        return [y[1], capsule + g, y[3], capsule] if free else [0, 0, y[3], (capsule - eta * g) / (1 + eta)]

    return rates


MOTIONS = {
    "belt": (
        Belt(**BELT),
        [0.588 + 0.25 * np.cos(1), 1.0],
        {"slower": belt(mp.mpf(BELT["mu_k"])), "stick": lambda y, c: [BELT["vb"], 0]},
    ),
    "friction": (
        StrobedFriction(),
        [0.3, 0.9],
        {"slower": friction(mp.mpf("0.5")), "faster": friction(-mp.mpf("0.5")), "stick": lambda y, c: [mp.mpf("0.2"), 0]},
    ),
    "pair in contact": (RecoilPair(**PAIR, contact=True), [0.01, 0.19, -0.67, 5.5], {"flight": pair(True), "base": pair(False)}),
}


def forced(rates, phase, rate, states):
    """States by the time from a phase. With sine and cosine of the forcing and 1 as further states, rates are linear."""
    w, unit = mp.mpf(rate), np.eye(len(states) + 2, dtype=int).tolist()

    def of(y):
        return [*rates(y[:-2], y[-1]), w * y[-1], -w * y[-2], 0]

    constant = of([0] * len(unit))
    columns = [[a - b for a, b in zip(of(row), constant, strict=True)] for row in unit] + [constant]
    matrix = arb_mat([[number(x) for x in row] for row in zip(*columns, strict=True)])
    start = arb_mat([[number(x)] for x in (*states, mp.sin(phase), mp.cos(phase), 1)])
    return lambda time: ((matrix * time).exp() * start).entries()[: len(states)]


@pytest.mark.parametrize("name", MOTIONS)
def test_flights_are_matrix_exponentials_of_thirty_digits(name):
    system, start, rates = MOTIONS[name]
    made = track(system, start, 40 if "contact" in name else 9, n_samples=4)
    assert set(made.modes.tolist()) == set(rates)
    with mp.workdps(DIGITS), ctx.workdps(DIGITS):
        for k, mode in enumerate(made.modes.tolist()):
            flow = forced(rates[mode], mp.mpf(made.events.phase[k]), system.phase_rate(), made.events.after[k])
            for time, states in zip(made.time[k, 1:], made.states[k, 1:], strict=True):
                expected = flow(number(time) - number(made.time[k, 0]))
                size = 1 + np.abs(made.states[k]).max() + made.time[k, -1]
                assert all(abs(number(a) - b) < ROUNDING * size for a, b in zip(states, expected, strict=True))


@pytest.mark.parametrize("name", MOTIONS)
def test_flights_join_events(name):
    """Each ends in the states just before the next event; phases and times advance together."""
    system, start, _ = MOTIONS[name]
    made = track(system, start, 30, n_samples=7)
    events = made.events
    assert made.states[:, -1] == pytest.approx(events.before[1:], abs=1e-13)
    assert np.array_equal(made.states[:, 0], events.after[:-1])
    assert np.array_equal(made.time[:, -1], events.time[1:])
    turned = events.phase[0] + system.phase_rate() * events.time
    assert np.exp(1j * events.phase) == pytest.approx(np.exp(1j * turned), abs=1e-12)
    times, states = system.trajectory(start, 30, n_samples=7)
    assert np.array_equal(times, made.time.ravel())
    assert np.array_equal(states, made.states.reshape(-1, len(system.states)))


@pytest.mark.parametrize("name", ["belt", "friction"])
def test_events_of_the_section_are_the_orbit(name):
    system, start, _ = MOTIONS[name]
    made = track(system, start, 60, n_samples=2)
    letters = {"belt": ["M", "P"], "friction": ["O"]}[name]
    here = np.isin(made.events.letter, letters)
    orbit = nsmaps.orbit(system, start, here.sum() - 1)
    by_name = dict(zip(made.names, made.events.before[here].T, strict=True)) | {"phi": made.events.phase[here]}
    for k, coordinate in enumerate(system.coordinates):
        assert by_name[coordinate] == pytest.approx(orbit.states[:, k], abs=1e-12)


def test_chatter_leads_to_contact_and_contact_to_its_release():
    system, start, _ = MOTIONS["pair in contact"]
    made = track(system, start, 40)
    contact = made.modes.tolist().index("base")
    assert set(made.modes[:contact].tolist()) == {"flight"}
    assert (np.diff(made.events.time)[:contact][1:] < np.diff(made.events.time)[: contact - 1]).all()
    assert made.states[contact, :, 0] == pytest.approx(np.full(60, 0.175), abs=1e-15)
    assert (made.states[contact, :, 1] == 0).all()
    release = made.events.before[contact + 1], made.events.phase[contact + 1]
    force = np.cos(release[1]) - 0.04 * release[0][2] - 0.2 * release[0][3] + 0.2113
    assert force == pytest.approx(0, abs=1e-13)


def test_a_start_after_the_reset_and_a_motion_that_ends():
    """The block starts at its corner with the speed after the impact, and overturns: there its motion ends."""
    made = track(RockingBlock(a=4.0, w=4.0), [0.6, 1.0], 50)
    assert made.events.before[0] == pytest.approx([0, 0.6])
    assert made.events.after[0] == pytest.approx([0, 0.6])
    assert made.events.name[-1].startswith("E to the")
    assert len(made.events.time) == len(made.modes) + 1 < 50
    assert abs(made.states[-1, -1, 0]) == pytest.approx(2, abs=1e-14)


def test_a_system_without_forcing():
    """The converter's ramp falls once a period of its clock, in volts and seconds."""
    converter = BuckConverter(E=22.0)
    start = nsmaps.orbit(converter, [12.0, 0.55], 200).final
    made = track(converter, start, 40)
    section = made.events.name == made.events.name[0]
    periods = np.diff(made.events.time[section])
    assert periods == pytest.approx(np.full(len(periods), periods[0]), rel=1e-12)
    assert (made.events.phase == 0).all()


@pytest.mark.parametrize(
    ("start", "n", "samples", "said"),
    [
        ([np.nan, 0.1], 5, 9, message("exact.not-a-start", state="[nan 0.1]")),
        ([0.838, 0.0], 1, 9, message("exact.samples", number=1, samples=9)),
        ([0.838, 0.0], 5, 1, message("exact.samples", number=5, samples=1)),
        ([0.7, 1.0], 5, 9, message("exact.not-on-section", guard="M")),
        ([0.7], 5, 9, message("errors.shape", what="the start has", shape="(1,)")),
    ],
)
def test_tracks_that_cannot_be(start, n, samples, said):
    with pytest.raises(StateError, match=said):
        track(Belt(**BELT), start, n, samples)


def test_a_start_may_be_given_by_name():
    made, by_name = track(Belt(**BELT), [0.838, 0.0], 5), track(Belt(**BELT), {"phi": 0.0, "x": 0.838}, 5)
    assert np.array_equal(made.states, by_name.states)
