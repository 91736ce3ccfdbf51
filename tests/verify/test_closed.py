"""Closed sets: found, verified, refused where cells are removed or added; theorems of other systems by the commands."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from messages import message
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import ProofError
from nsmaps.plugins import study_files

pytest.importorskip("flint")

from nsmaps.proof.closed import Around
from nsmaps.proof.prove import prove
from nsmaps.verify.cells import SPLIT, CertificateError, Grid, tree_of
from nsmaps.verify.certificate import Certificate, statement, verify

SHAPES = {"side": 256, "depth": 0, "top": 1.0633, "max_periods": 2}
START, FINE = [0.7, 0.3], 512
LEFT, TOP = 65535, 1089 / 1024


@pytest.fixture(scope="module")
def pair():
    return nsmaps.load_system("vi_pair", d=0.26, g_bar=0.2113275)


@pytest.fixture(scope="module")
def certificate(pair):
    return prove(pair, START, around=Around(depth=1, transient=500, n_samples=5000), **SHAPES)


def expanded(certificate, walls):
    """The order at every place of the finest grids: wall, column, row."""
    grid = Grid(**certificate.grid)
    tree, side = tree_of(grid, walls, certificate.codes), grid.side << grid.depth
    found = np.full((walls, side, side), LEFT)
    for width in np.unique(tree.width):
        nodes, wide = np.flatnonzero((tree.child < 0) & (tree.width == width))[:, None, None], width * side // tree.n
        column, row = tree.first[nodes] * side // tree.n, tree.row[nodes] * wide
        found[tree.wall[nodes], column + np.arange(wide)[:, None], row + np.arange(wide)] = tree.order[nodes]
    return found


@pytest.fixture(scope="module")
def orders(certificate):
    return expanded(certificate, 2)


def met(orders, impacts, top=TOP):
    """The orders of the cells that impacts meet."""
    columns, rows = impacts.phase % (2 * np.pi) / (2 * np.pi) * orders.shape[1], impacts.speed / top * orders.shape[1]
    return orders[impacts.wall, columns.astype(int), rows.astype(int)]


def test_a_closed_set_is_found_verified_and_stated(pair, certificate, orders):
    """An orbit on the attractor stays in it, and its cells are those that are counted."""
    proved = verify(certificate)
    assert certificate.grid["top"] == TOP
    assert proved.shares == pytest.approx((orders < SPLIT).mean(axis=(1, 2)))
    assert proved.closed == pytest.approx((orders == 0).mean(axis=(1, 2)))
    assert min(proved.shares) > 0.2
    text = statement(proved, certificate)
    stated = float(text.split("arrive in the closed set of the cells of order zero, ")[1].split(" % of wall B")[0])
    assert 0 <= stated - 100 * proved.closed[0] < 1e-3 * stated  # never less than the set
    impacts = pair.impacts(START, 5500)
    assert (met(orders, impacts)[500:] == 0).all()
    seen = np.zeros_like(orders)
    phases, speeds = impacts.phase[500:] % (2 * np.pi), impacts.speed[500:]
    seen[impacts.wall[500:], (phases * FINE / (2 * np.pi)).astype(int), (speeds * FINE / TOP).astype(int)] = 1
    cells = ", ".join(f"{(orders[i] == 0).sum()} and {seen[i].sum()} on wall {'BT'[i]}" for i in (0, 1))
    assert certificate.about["attractor"].endswith(cells)


def test_orbits_from_cells_with_orders_arrive_and_stay(pair, orders):
    rng = np.random.default_rng(7)
    ordered = np.argwhere((orders[0] > 0) & (orders[0] < SPLIT))
    assert len(ordered) > 100
    for column, row in rng.permutation(ordered)[:100]:
        state = np.array([(row + rng.random()) * TOP, (column + rng.random()) * 2 * np.pi]) / FINE
        later = met(orders, pair.impacts(state, 300))
        arrived = np.flatnonzero(later == 0)
        assert arrived.size
        assert (later[arrived[0] :] == 0).all()


@pytest.mark.parametrize("wrong", ["removed", "added", "changed", "not closed", "trap beside"])
def test_changes_of_a_closed_set_are_refused(certificate, wrong):
    codes, more = certificate.codes.copy(), {}
    inside = np.flatnonzero(codes == 0)
    match wrong:
        case "removed":
            codes[inside[len(inside) // 2]] = LEFT
        case "added":
            codes[np.flatnonzero(codes == LEFT)[0]] = 0
        case "changed":
            codes[inside[len(inside) // 2]] = 1
        case "not closed":
            more = {"grid": {**certificate.grid, "closed": False}}
        case "trap beside":
            more = {"trap": {"wall": 0}}
    with pytest.raises(CertificateError):
        verify(replace(certificate, codes=codes, **more))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"stiffness": ["1", "0"]}, message("verify.resonance")),
        ({"stiffness": ["1", "1e-9"], "damping": ["1e-12", "0"]}, message("verify.resonance")),
        ({"force": ["nan", "0"]}, message("verify.not-finite")),
        ({"walls": [{"letter": "B", "at": ["1", "inf"], "side": 1}]}, message("verify.not-finite")),
        ({"stiffness": ["-1e6", "0"]}, message("verify.no-bound")),
    ],
)
def test_rest_is_not_proved_of_a_system_without_bounds(change, reason):
    """A closed set of the lowest cells, where bounds that are not numbers would leave nothing to compare."""
    zero = ["0", "0"]
    system = dict.fromkeys(("damping", "stiffness", "force", "sine"), zero) | {"cosine": ["1", "0"], "frequency": ["1", "0", 0]}
    system |= {"restitution": ["0.5", "0"], "walls": [{"letter": "B", "at": zero, "side": 1}]}
    codes = np.full((32, 32), LEFT, np.uint16)
    codes[:, 0] = 0
    grid = {"side": 32, "depth": 0, "top": 1.0, "periods": 1, "closed": True}
    with pytest.raises(CertificateError, match=reason):
        verify(Certificate({}, system | change, {}, grid, codes.ravel()))


def test_a_closed_set_that_is_not_found(pair, monkeypatch):
    with pytest.raises(ProofError, match=message("proof.not-on-attractor")):
        prove(pair, START, around=Around(0, 100, 500), **{**SHAPES, "top": 0.5})
    with pytest.raises(ProofError, match=message("proof.not-on-attractor", number=1, top=1)):
        prove(
            nsmaps.load_system("impact_oscillator", zeta=0.1, w=2, A=0.1, wall=1, r=0.1),
            [0.01, 1.0],
            around=Around(0, 0, 9),
            top=1,
        )
    monkeypatch.setattr("nsmaps.proof.closed.LARGEST", 50)
    with pytest.raises(ProofError, match=message("proof.too-many-meet", most=50)):
        prove(pair, START, around=Around(0, 100, 500), **SHAPES)


@pytest.mark.thorough
def test_all_states_of_the_oscillator_are_proved_to_converge(monkeypatch):
    """From its lowest cells, impact by impact without an end of chatter, orders fall or stay in one cell."""
    for key, value in (("SIZES", (0.03,)), ("SHAPES", ((0.6, (8, 4)),)), ("TURNS", (1,))):
        monkeypatch.setattr(f"nsmaps.proof.trap.{key}", value)
    system = nsmaps.load_system("impact_oscillator", zeta=0.1, w=0.8, A=1.0, wall=0.4, r=0.7)
    made = prove(system, {"v": 0.766, "phi": 1.179}, 2, top=3, side=128, depth=4, max_periods=2)
    proved = verify(made)
    assert proved.shares == (1.0,)
    assert "none is left open" in statement(proved, made)
    orders, rng, falls = expanded(made, 1), np.random.default_rng(4), 0
    for state in rng.random((300, 2)) * [0.012, 2 * np.pi]:
        seen = met(orders, system.impacts(state, 30, chatter=0), 3)
        end = np.append(np.flatnonzero(seen == 0), len(seen))[0]
        assert (np.diff(seen[:end]) <= 0).all()
        falls += (np.diff(seen[:end]) < 0).sum()
    assert falls > 1000


@pytest.mark.parametrize(
    ("name", "shape", "words", "least"),
    [
        ("bouncing_ball/proof", {"side": 256, "depth": 0}, "converge to one cycle of", 5),
        ("bouncing_ball/proof-rest", {"side": 128, "depth": 0}, "arrive in the closed set", 50),
        pytest.param(
            "impact_oscillator/proof", {"side": 64, "depth": 2}, "converge to one cycle of", 50, marks=pytest.mark.thorough
        ),
    ],
)
def test_theorems_of_other_systems(tmp_path, monkeypatch, name, shape, words, least):
    """The shipped studies with coarser cells and traps."""
    for key, value in (("SIZES", (0.08, 0.03)), ("SHAPES", ((0.6, (8, 4)),)), ("TURNS", (2, 1))):
        monkeypatch.setattr(f"nsmaps.proof.trap.{key}", value)
    plugin, study = name.split("/")
    data = yaml.safe_load(study_files(plugin)[study].read_text(encoding="utf-8"))
    data["proof"] |= shape
    if "closed_set" in data["proof"]:
        data["proof"]["closed_set"] = {"depth": 0, "transient": 200, "n_samples": 100}
    (tmp_path / "small.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    path = tmp_path / "small.proof"
    made = CliRunner().invoke(app, ["prove", str(tmp_path / "small.yaml"), "--out", str(path), "-q"])
    assert made.exit_code == 0, made.output
    again = CliRunner().invoke(app, ["verify", str(path), "-q"])
    assert again.exit_code == 0
    assert words in again.output
    assert float(again.output.split("order, ")[1].split(" %")[0]) > least
