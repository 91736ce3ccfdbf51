"""First arrivals at the section of states anywhere in a mode, against references of 40 digits and the map itself."""

import numpy as np
import pytest
from hybrid import StrobedFriction, numbers, reference, system
from messages import message
from nsmaps_recoil_pair import RecoilPair
from nsmaps_rocking_block import RockingBlock
from nsmaps_soft_impact import SoftImpact

from nsmaps.coordinates import TWO_PI
from nsmaps.errors import StateError
from nsmaps.exact.modes.march.returns import arrivals as compiled
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.trajectory import track

PAIR = {"eta": 0.1, "kappa": 0.04, "Lambda": 0.2, "d": 0.35, "r": 0.5, "g_bar": 0.2113}
STRIPS = {"xi": 0.01, "e": 1.26, "a": 0.7, "beta": 29, "w": 0.79}
ROUNDING = 4e-15


def beside(found, expected):
    """The largest difference of images in which an angle is the last, on the circle."""
    off = np.abs(np.asarray(found) - expected)
    off[..., -1] = np.minimum(off[..., -1], TWO_PI - off[..., -1])
    return off.max(axis=-1)


def test_one_state_and_many_follow_the_same_compiled_code():
    """Which is shipped: phases that are not in a row would have it compiled anew."""
    pair, start = RecoilPair(**PAIR), [[0.0, 0.1, 0.2, 0.3, 1.0]]
    alone, among = pair.arrivals(start), pair.arrivals(start * 3)
    assert (among.image == alone.image).all()
    assert len({signature[0] for signature in compiled.signatures}) == len(compiled.signatures)  # affine and nonlinear tables


@pytest.mark.parametrize("given", [True, False])
def test_arrivals_of_the_references(given):
    """Of the belt: slip below or above its speed is chosen by the guards, or given."""
    known = reference("S3_stickslip")
    count = 0
    for key, parameters in known["parameters"].items():
        rows = [row for row in known["arrivals"] if row["params"] == key and row["image"] is not None]
        if not rows:
            continue
        belt, starts = system("S3_stickslip", parameters), np.array([numbers(row["start"]) for row in rows])
        modes = np.where(starts[:, 1] < belt.vb, "slower", "faster")
        arrivals = belt.arrivals(starts, modes.tolist() if given else None)
        assert arrivals.mode.tolist() == modes.tolist()
        assert arrivals.words.tolist() == [row["word"] for row in rows]
        allowed = np.array([ROUNDING * (1 + float(row["jac_inf_norm"]) + float(row["time_grad_norm"])) for row in rows])
        assert (beside(arrivals.image, [numbers(row["image"]) for row in rows]) < 4 * allowed).all()
        assert (np.abs(arrivals.time - [float(row["return_time"]) for row in rows]) < 4 * allowed).all()
        count += len(rows)
    assert count > 20


def test_just_after_the_section_they_are_first_returns():
    """The state after an impact arrives where the state before it returns; so does the block's, whose section is after."""
    pair, block = RecoilPair(**PAIR), RockingBlock(a=0.8, w=4.0)
    rng = np.random.default_rng(2)
    starts = np.column_stack([rng.uniform(0.2, 1, 30), rng.normal(0, 0.3, (30, 2)), rng.uniform(0, TWO_PI, 30)])
    after = [track(pair, start, 2, n_samples=2).events.after[0] for start in starts]
    arrivals = pair.arrivals(np.column_stack([np.array(after) - [1e-13, 0, 0, 0], starts[:, 3]]))
    returns = pair.first_return(starts)
    assert [f"B{word}" for word in arrivals.words] == returns.words.tolist()
    assert beside(arrivals.image, returns.image).max() < 1e-9
    states = np.column_stack([np.full(20, 1e-14), rng.uniform(0.2, 1, 20), rng.uniform(0, TWO_PI, 20)])
    images, expected = block.arrivals(states, "right").image, block.first_return(states[:, 1:]).image
    assert np.nanmax(beside(images, expected)) < 1e-9
    assert np.array_equal(np.isnan(images), np.isnan(expected))


@pytest.mark.parametrize("kind", [SoftImpact, RecoilPair])
def test_from_flights_they_are_the_next_event_of_the_section(kind):
    chosen = kind(**(STRIPS if kind is SoftImpact else PAIR))
    start = [0.5, 1.0] if kind is SoftImpact else [0.84, 0.19, -0.67, 0.32]
    made = track(chosen, start, 12, n_samples=5)
    at, letter, times = made.events.time, made.events.letter, made.time[:, 2]
    states = np.column_stack([made.states[:, 2], made.events.phase[:-1] + chosen.phase_rate() * (times - at[:-1])])
    arrivals = chosen.arrivals(states, made.modes.tolist())
    section = at[letter == letter[0]]
    ahead = [section[section > time][:1] for time in times]
    known = np.array([len(one) > 0 for one in ahead])
    assert known.sum() > 5
    assert arrivals.time[known] + times[known] == pytest.approx(np.concatenate(ahead), abs=1e-11)


def test_derivatives_are_those_of_differences():
    pair = RecoilPair(**PAIR)
    start = np.array([[0.05, 0.3, 0.1, -0.6, 2.0]])
    slopes = pair.arrivals(start, derivative=True).derivative[0]
    assert slopes.shape == (4, 5)
    for k in range(5):
        h = 1e-6 * np.eye(5)[k]
        ends = [pair.arrivals(start + sign * h) for sign in (1, -1)]
        lifted = [end.image + TWO_PI * end.turns for end in ends]
        assert slopes[:, k] == pytest.approx((lifted[0] - lifted[1])[0] / 2e-6, abs=1e-7)


def test_a_mode_divided_by_a_section_that_changes_nothing():
    """Before and after the phase pi, where the section's function rises: the next phase zero either way."""
    disc, phases = StrobedFriction(), np.array([0.5, 3.0, 3.3, 6.0])
    arrivals = disc.arrivals(np.column_stack([np.full(4, 0.3), np.full(4, -0.4), phases]))
    assert (arrivals.mode == "slower").all()
    assert arrivals.time == pytest.approx(TWO_PI - phases, abs=1e-13)


def test_sliding_is_given_or_begins_at_once_and_contact_is_given():
    disc = StrobedFriction()
    sliding = disc.arrivals([[0.0, 0.2, 1.0]], "stick")
    assert sliding.mode.tolist() == ["stick"]
    assert sliding.words[0].endswith("O")
    assert disc.arrivals([[0.0, 0.2, 1.0]]).image == pytest.approx(sliding.image, abs=1e-15)
    pair = RecoilPair(**PAIR, contact=True)
    state = [0.175, 0.0, 0.19, -0.67, 0.2]
    (rest,) = pair.arrivals([state], "base").words
    assert rest.startswith("B")
    assert pair.arrivals([state], "flight").outcome.tolist() != [Outcome.returned]


def test_states_that_are_in_no_mode():
    arrivals = RecoilPair(**PAIR).arrivals([[0.3, 0, 0, 0, 1], [np.nan, 0, 0, 0, 1], [0, 0.2, 0, 0, 1], [0, 0.2, 0, 0, 1e11]])
    assert arrivals.outcome.tolist() == [Outcome.invalid] * 2 + [Outcome.returned, Outcome.invalid]
    assert arrivals.valid.tolist() == [False, False, True, False]
    assert arrivals.mode.tolist() == ["", "", "flight", ""]


@pytest.mark.parametrize(
    ("states", "modes", "why"),
    [
        ([[0.1, 0, 0, 0]], None, message("errors.shape", what="states have", shape="(1, 4)")),
        ([[0.1, 0, 0, 0, 1]], "fligth", message("exact.not-a-mode-near")),
        ([[0.1, 0, 0, 0, 1]], ["flight", "flight"], message("exact.modes-of-states", modes=2, states=1)),
    ],
)
def test_what_is_refused(states, modes, why):
    with pytest.raises(StateError, match=why):
        RecoilPair(**PAIR).arrivals(states, modes)
