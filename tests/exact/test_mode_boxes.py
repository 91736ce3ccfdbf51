"""Images of boxes of systems with modes against exact returns of their states, returns in balls of another library, vi_pair."""

import numpy as np
import pytest
from hybrid import SYSTEMS, numbers, reference, system
from messages import message
from nsmaps_soft_impact import SoftImpact
from nsmaps_vi_pair import VIPair
from systems import Coulomb

import nsmaps
from nsmaps.errors import ProofError, StateError
from nsmaps.exact.outcome import Outcome

STATES = 200


def starts_of(name, key):
    """The starts of the references of a set of parameters."""
    return np.array([numbers(row["start"]) for row in reference(name)["returns"] if row["params"] == key])


def keys_of(name):
    """The sets of parameters that have returns."""
    given = reference(name)
    return [key for key in given["parameters"] if any(row["params"] == key for row in given["returns"])]


def boxes_near(starts, rng, number, size, around=0.1):
    """Boxes near starts, in shares of the box that these fill."""
    scale = np.ptp(starts, axis=0)
    scale[scale == 0] = 1.0
    centres = starts[rng.integers(0, len(starts), number)] + around * (rng.random((number, len(scale))) - 0.5) * scale
    half = 0.5 * size * scale * rng.random((number, len(scale)))
    return np.stack([centres - half, centres + half], axis=-1)


def states_in(boxes, rng, number=STATES):
    """States of each box, shape (N, number, n): its corners and random ones."""
    m = boxes.shape[1]
    share = rng.random((len(boxes), number, m))
    share[:, : 2**m] = list(np.ndindex((2,) * m))
    low, high = boxes[:, None, :, 0], boxes[:, None, :, 1]
    return np.clip(low + share * (high - low), low, high)


def missed(made, boxes, rng, rounding):
    """Which states have an exact image that lies in no image box of their word, and the enclosure and the images."""
    found, states = made.image_boxes(boxes), states_in(boxes, rng)
    states = made.on_section(states.reshape(-1, states.shape[2])).reshape(states.shape)
    beside = ((states < boxes[:, None, :, 0]) | (states > boxes[:, None, :, 1])).any(axis=2)
    returns = made.first_return(states.reshape(-1, states.shape[2]))
    shape = states.shape[:2]
    images, words = returns.lifted.reshape(states.shape), returns.words.reshape(shape)
    outcome = returns.outcome.reshape(shape)
    decided, valid = outcome != Outcome.undecided, outcome == Outcome.returned
    held = beside | ~found.bounded[:, None] | ~decided | (~valid & found.empty[:, None])
    slack = rounding * np.maximum(1.0, np.abs(np.nan_to_num(images)).max(axis=(0, 1)))
    for source, (low, high), word in zip(found.source, found.images.transpose(0, 2, 1), found.words, strict=True):
        inside = ((images[source] >= low - slack) & (images[source] <= high + slack)).all(axis=1)
        held[source] |= inside & ((words[source] == word) | (word == ""))
    return states[~held], found, images, words, valid


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("size", [1e-5, 2e-2])
def test_exact_images_lie_in_the_image_boxes(name, size):
    rng = np.random.default_rng(1)
    assert keys_of(name)
    for key in keys_of(name):
        made = system(name, reference(name)["parameters"][key])
        states, found, *_ = missed(made, boxes_near(starts_of(name, key), rng, 12, size), rng, 1e-12)
        assert len(states) == 0
        assert found.bounded.any()


@pytest.mark.thorough
@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("size", [1e-6, 1e-4, 1e-3, 1e-2, 0.1])
def test_exact_images_of_thousands_of_boxes(name, size):
    rng = np.random.default_rng(2)
    assert keys_of(name)
    for key in keys_of(name):
        made = system(name, reference(name)["parameters"][key])
        states, *_ = missed(made, boxes_near(starts_of(name, key), rng, 250, size, 0.5), rng, 1e-12)
        assert len(states) == 0


@pytest.mark.parametrize("name", [name for name in SYSTEMS if name != "S3_stickslip"])  # all of whose starts are random
def test_boxes_cut_by_grazes_and_conditions(name):
    """About starts of the references that are not random, most of them next to changes of the word."""
    rng, tried = np.random.default_rng(3), 0
    assert keys_of(name)
    for key in keys_of(name):
        made, scale = system(name, reference(name)["parameters"][key]), np.ptp(starts_of(name, key), axis=0)
        rows = [row for row in reference(name)["returns"] if row["params"] == key and row["kind"] != "random"]
        points = np.array([numbers(row["start"]) for row in rows])[:8]
        for size in (1e-6, 1e-4, 1e-2) if len(points) else ():
            half = 0.5 * size * np.where(scale > 0, scale, 1.0)
            states, *_ = missed(made, np.stack([points - half, points + half], axis=-1), rng, 1e-7)
            assert len(states) == 0
            tried += len(points)
    assert tried > 10


@pytest.mark.parametrize("name", [name for name in SYSTEMS if name not in ("S3_stickslip", "S4_rocking")])
def test_images_are_narrow_away_from_grazes(name):
    """At sides of 2^-10 of where the references start, beside hulls of 200 states; the excess falls with the size."""
    key, rng, excess = keys_of(name)[0], np.random.default_rng(4), []
    made = system(name, reference(name)["parameters"][key])
    for size in (2.0**-10, 2.0**-12):
        _, found, images, words, valid = missed(made, boxes_near(starts_of(name, key), rng, 100, size), rng, 1e-12)
        one = (words == words[:, :1]).all(axis=1) & valid.all(axis=1) & found.bounded
        wide = (np.ptp(found.hulls(), axis=2) / np.ptp(images, axis=1))[one]
        assert one.mean() > 0.8
        excess.append(np.median(wide) - 1.0)
    assert excess[0] < 0.2
    assert excess[1] < 0.5 * excess[0]


def test_references_of_40_digits_lie_in_the_images_of_points():
    """The images of points are as wide as rounding."""
    for name in SYSTEMS:
        rows = [row for row in reference(name)["returns"] if row["kind"] == "random" and row["image"] is not None]
        rows = [row for row in rows if float(row["jac_inf_norm"]) <= 100]
        assert rows
        for row in rows:
            made = system(name, reference(name)["parameters"][row["params"]])
            start = np.array(numbers(row["start"]))
            found = made.image_boxes([np.stack([start, start], axis=-1)])
            assert found.bounded.all()
            off = np.array(numbers(row["image"])) - found.images[0].mean(axis=1)
            off = np.where(made.coordinates.angles, (off + np.pi) % (2 * np.pi) - np.pi, off)
            slack = 1e-13 * max(1.0, float(row["jac_inf_norm"])) * max(1.0, np.abs(start).max())  # decimals are rounded
            width = np.ptp(found.images[0], axis=1)
            assert (np.abs(off) <= 0.5 * width + slack).all()
            assert (width <= 100 * slack).all()


def test_without_recoil_it_encloses_the_images_of_the_vibro_impact_pair():
    """The enclosures of two engines have the images in common, and are alike."""
    rng = np.random.default_rng(5)
    pair = VIPair(d=0.35, g_bar=0.2113)
    recoil = system("S1_recoil", {"eta": 0, "kappa": 0, "Lambda": 0, "d": 0.35, "r": 0.5, "g_bar": 0.2113})
    centres = np.column_stack([rng.uniform(0.55, 1, 200), rng.uniform(0.05, 1.25, 200)])
    half = np.array([0.45, 1.2]) / 2048
    boxes = np.stack([centres - half, centres + half], axis=-1)
    still = np.zeros((200, 2, 2))
    one, other = pair.image_boxes(boxes), recoil.image_boxes(np.concatenate([boxes[:, :1], still, boxes[:, 1:]], axis=1))
    alone = (np.bincount(one.source, minlength=200) == 1) & (np.bincount(other.source, minlength=200) == 1)
    assert alone.mean() > 0.9
    assert one.words[np.isin(one.source, np.flatnonzero(alone))].tolist() == (
        other.words[np.isin(other.source, np.flatnonzero(alone))].tolist()
    )
    a, b = one.hulls()[alone], other.hulls()[alone][:, [0, 3]]
    assert (np.maximum(a[..., 0], b[..., 0]) <= np.minimum(a[..., 1], b[..., 1])).all()
    assert np.median(np.ptp(b, axis=2) / np.ptp(a, axis=2)) < 1.05
    images = pair.first_return(states_in(boxes, rng).reshape(-1, 2)).lifted.reshape(200, STATES, 2)[alone]
    assert (images >= b[:, None, :, 0] - 1e-12).all()
    assert (images <= b[:, None, :, 1] + 1e-12).all()


def arb_rocking(flint, made, v, phi, until):
    """Place, velocity and phase of a block that leaves x = 0 about its right corner, at a time, in balls of python-flint."""
    a, w = flint.arb(made.a), flint.arb(made.w)
    k = -a / (1 + w * w)  # x = 1 + k cos(w t + phi) + c e^t + d e^-t
    low, slope = 1 + k * phi.cos(), v + k * w * phi.sin()
    c, d = (slope - low) / 2, (-slope - low) / 2
    turned = phi + w * until
    return 1 + k * turned.cos() + c * until.exp() + d * (-until).exp(), -k * w * turned.sin() + c * until.exp() - d * (
        -until
    ).exp()


def test_flights_in_balls_of_another_library(monkeypatch):
    """A flight of a block in closed form: thin pieces of a box, whose time of impact is enclosed by a change of sign."""
    flint = pytest.importorskip("flint")
    made = system("S4_rocking", reference("S4_rocking")["parameters"]["a08w4"])
    centre = np.array([0.6, 2.0])
    box = np.stack([centre - 1e-3, centre + 1e-3], axis=-1)
    found = made.image_boxes(box[None])
    assert found.bounded.all()
    assert found.words.tolist() == ["RLR"]
    monkeypatch.setattr(flint.ctx, "prec", 120)
    for share in np.random.default_rng(6).random((40, 2)):
        v, phi = (flint.arb(float(x)) for x in box[:, 0] + share * np.ptp(box, axis=1))
        image = [v, phi]
        for side in (1, -1):  # about the right corner, then about the left one by symmetry
            start = image[0], image[1] + (flint.arb.pi() if side < 0 else 0)
            low, high = flint.arb(0.01), flint.arb(0.01)
            while arb_rocking(flint, made, *start, high)[0] > 0:
                high += 0.01
            low = high - 0.01
            for _ in range(100):
                middle = ((low + high) / 2).mid()
                place, _ = arb_rocking(flint, made, *start, middle)
                low, high = (middle, high) if place > 0 else (low, middle)
            when = low.union(high)
            _, speed = arb_rocking(flint, made, *start, when)
            image = [-speed * flint.arb(made.r), image[1] + flint.arb(made.w) * when]
        low, high = found.images[0, :, 0], found.images[0, :, 1]
        for k in range(2):
            assert float(image[k].lower()) >= low[k] - 1e-15 * abs(low[k])
            assert float(image[k].upper()) <= high[k] + 1e-15 * abs(high[k])


def test_phases_on_any_turn():
    made = system("S2_bilinear", reference("S2_bilinear")["parameters"]["w085"])
    box = np.array([[0.8, 0.801], [0.4, 0.401]])
    turn = np.array([[0], [20 * np.pi]])
    assert made.image_boxes([box + turn]).images == pytest.approx(made.image_boxes([box]).images + turn, abs=1e-12)
    here, there = made.first_return([box[:, 0], (box + turn)[:, 0]]).lifted
    assert there == pytest.approx(here + turn[:, 0], abs=1e-12)
    whole = made.image_boxes([[[0.8, 0.801], [0.4, 20.0]]])
    assert np.ptp(whole.hulls()[0, 1]) >= 2 * np.pi


def test_where_states_have_no_image():
    made = system("S2_bilinear", reference("S2_bilinear")["parameters"]["w085"])
    found = made.image_boxes([[[-0.5, -0.4], [1.0, 1.1]], [[-0.1, 0.4], [1.0, 1.1]], [[0.9, 1.0], [1.0, 1.1]]])
    assert found.empty.tolist() == [True, True, False]
    assert np.isnan(found.hulls()[0]).all() or not found.bounded[0]
    assert made.image_boxes(np.empty((0, 2, 2))).hulls().shape == (0, 2, 2)
    block = system("S4_rocking", reference("S4_rocking")["parameters"]["a08w4"])
    gone = block.image_boxes([[[3.0, 3.001], [1.0, 1.001]]])  # fast enough to overturn
    assert gone.empty.all()
    assert gone.bounded.all()
    assert len(gone.images) == 0


@pytest.mark.thorough
def test_sliding_and_starts_outside_of_the_domain():
    """Of half of the starts the friction falls: they are at the section, but not at its event, and have no image."""
    rng, made = np.random.default_rng(7), Coulomb()
    phi, side = rng.uniform(0, 6.28, 30), rng.choice([-1, 1], 30)
    starts = np.column_stack([side * 0.6 - 0.02 + 0.3 * np.cos(phi), phi])
    for size in (1e-6, 1e-3, 2e-2):
        states, found, _, _, valid = missed(made, np.stack([starts - size / 2, starts + size / 2], axis=-1), rng, 1e-11)
        assert len(states) == 0
        assert found.bounded.all()
        assert 0.2 < valid.mean() < 0.8


def test_a_reset_that_is_not_affine_is_refused():
    class Curved(SoftImpact):
        def guards(self, t, y):
            return {**super().guards(t, y), "F": nsmaps.Guard("contact", y.x - self.e, to="free", reset={"v": -(y.v**2)})}

    with pytest.raises(ProofError, match=message("exact.reset-not-enclosed", system="Curved", guard="F")):
        Curved(xi=0.01, e=1.26, a=0.7, beta=29, w=0.75).image_boxes([[[0.9, 1.0], [1.0, 1.1]]])


@pytest.mark.parametrize(
    ("boxes", "why"),
    [([[1, 2]], message("errors.shape", what="boxes have", shape="(1, 2)")), ([[[1, 0], [0, 1]]], message("exact.box"))],
)
def test_what_is_no_box_is_refused(boxes, why):
    with pytest.raises(StateError, match=why):
        system("S2_bilinear", reference("S2_bilinear")["parameters"]["w085"]).image_boxes(boxes)
