"""A certificate of convergence that is kept with the documentation: verified, drawn, and compared with exact orbits."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from nsmaps.cli.cli import app

pytest.importorskip("flint")

from ladder import ladder
from matplotlib.image import imread

from nsmaps.cells.certified import Orders
from nsmaps.verify.arrivals import LEFT
from nsmaps.verify.cells import SPLIT
from nsmaps.verify.certificate import read

KEPT = Path(__file__).parents[2] / "docs" / "certificates"


@pytest.fixture(scope="module")
def attraction():
    return read(KEPT / "fp-coarse.proof")


@pytest.fixture(scope="module")
def cells(attraction):
    return Orders.of(attraction)


def test_orbits_come_down_to_the_trap(pair, attraction, cells):
    """Each impact is in a cell of a lower order, and orbits from the trap converge to its cycle; other orders are found wrong."""
    rng = np.random.default_rng(1)
    found = ladder(pair(0.35), cells, 2000, rng)
    assert (found.states, found.wrong, found.lost) == (2000, 0, 0)
    end = found.ends
    for _ in range(150):
        end = pair(0.35).first_return(end).image
    np.testing.assert_allclose(end, np.broadcast_to(attraction.trap["centre"][::-1], end.shape), atol=1e-12)
    order = cells.tree.order.copy()
    some = np.flatnonzero((order > 0) & (order < SPLIT))
    order[some] = rng.permutation(order[some])
    assert ladder(pair(0.35), replace(cells, tree=cells.tree._replace(order=order)), 200, rng).wrong > 100


def test_pixels_have_the_shares_of_the_cells(attraction, cells):
    """Pixels that are sampled at each smallest cell have exactly the share that is left open, and states the order of theirs."""
    tree = cells.tree
    leaves = np.flatnonzero(tree.child < 0)
    for wall in (0, 1):
        own = leaves[tree.wall[leaves] == wall]
        left = ((tree.width[own] / tree.n) ** 2)[tree.order[own] == LEFT].sum()
        pixels = cells.pixels(wall, (256, 256), 4)
        assert pixels.left.mean() == pytest.approx(left, abs=1e-12)
        assert np.isnan(pixels.order).sum() == (pixels.left == 1).sum()
    middle = 2 * np.pi * (tree.first[leaves] + tree.width[leaves] / 2) / tree.n
    speed = (tree.row[leaves] + 0.5) * tree.width[leaves] * tree.top / tree.n
    assert (cells.cells(tree.wall[leaves], middle + 4 * np.pi, speed) == leaves).all()
    assert cells.orders(cells.cells(0, 1.0, [tree.top, -0.1])).tolist() == [LEFT, LEFT]


def test_the_picture_is_green_in_the_trap_and_blue_where_nothing_is_proved(tmp_path):
    """`nsmaps verify --figure` verifies, states the theorem, draws; other names and certificates without cells are refused."""
    path = tmp_path / "proved.png"
    result = CliRunner().invoke(app, ["verify", str(KEPT / "fp-coarse.proof"), "--figure", str(path), "-q"])
    assert result.exit_code == 0, result.output
    assert "Proved: all orbits" in result.output
    shares = re.findall(r"([\d.]+ %) of wall (B|T)", " ".join(result.output.split()))
    assert " and ".join(f"{share} of {wall}" for share, wall in shares) in (KEPT.parent / "explanation" / "proof.md").read_text()
    colours = (imread(path)[..., :3].reshape(-1, 3) * 255).round().astype(int)
    shares = [(abs(colours - np.array(colour)).max(axis=1) <= 1).mean() for colour in ((0, 158, 115), (0, 114, 178))]
    assert 5e-4 < shares[0] < 0.02
    assert 0.005 < shares[1] < 0.1
    for options, reason in (
        (["fp-coarse.proof", "--figure", "proved.gif"], "proved.gif"),
        (["cycles.proof", "--figure", str(path)], "of cells of phase and speed"),
    ):
        result = CliRunner().invoke(app, ["verify", str(KEPT / options[0]), *options[1:], "-q"])
        assert result.exit_code == 2
        assert reason in " ".join(result.output.split())
