"""Proofs of maps by formulas: balls against mpmath, cycles and entropies against closed forms; wrong claims are refused."""

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from flint import acb, arb, ctx, fmpq
from messages import message
from nsmaps_border_collision import Lozi
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import ProofError
from nsmaps.proof.cycles import certificate_of
from nsmaps.proof.horseshoe import certificate_of as horseshoe_around
from nsmaps.proof.maps.formula import stated_map
from nsmaps.proof.maps.prove import prove_map
from nsmaps.verify.cells import CertificateError
from nsmaps.verify.certificate import Certificate, read, statement, verify, write_certificate
from nsmaps.verify.formula import UnprovedError
from nsmaps.verify.maps.cycles import stated_of, verified
from nsmaps.verify.maps.formula import hull, jets, map_of, pieces_of
from nsmaps.verify.maps.proved import VerifiedMap


class Kinked(nsmaps.PiecewiseMap):
    """A map of two coordinates, one of them an angle, with most of the functions that formulas have."""

    a: float = 0.3
    coordinates = nsmaps.exact.Coordinates(("x", nsmaps.Angle("phi")))

    def pieces(self, y: Any) -> Any:
        x, phi = y.x, y.phi
        soft = sp.tanh(x) + sp.exp(-x * x) * sp.cos(phi) / 3 + sp.Abs(x - self.a) - sp.Max(x, sp.sin(phi)) / 2
        hard = sp.sqrt(x + 2) + sp.log(3 + x) * sp.atan(x) ** 2 - (x + 3) ** sp.Rational(3, 2) / 4
        return {
            "P": ((x < self.a) & (phi <= sp.pi), {"x": soft, "phi": phi + sp.asin(x / 3) + sp.sinh(x) / (2 + x**4)}),
            "Q": (x < 1, {"x": hard, "phi": phi - sp.cosh(x) + sp.acos(x / 2) + sp.tan(x / 2)}),
            "R": (True, {"x": sp.Min(x, 2 - x), "phi": 2 * phi}),
        }


class Root(nsmaps.PiecewiseMap):
    """The square-root map, of which the root is taken of what the condition shows to be above zero."""

    a: float = 0.5
    mu: float = 0.2
    coordinates = nsmaps.exact.Coordinates(("x",))

    def pieces(self, y: Any) -> Any:
        return {"L": (y.x <= 0, {"x": self.a * y.x + self.mu}), "R": (True, {"x": self.mu - sp.sqrt(y.x)})}


class Full(nsmaps.PiecewiseMap):
    """The tent with slopes s and -s on [0, 1]."""

    s: float = 2.0
    coordinates = nsmaps.exact.Coordinates(("x",))

    def pieces(self, y: Any) -> Any:
        return {"L": (y.x < sp.Rational(1, 2), {"x": self.s * y.x}), "R": (True, {"x": self.s * (1 - y.x)})}


@pytest.fixture(scope="module")
def lozi() -> Lozi:
    return Lozi(a=1.7, b=0.5)


def proved(certificate: Certificate, folder: Path) -> VerifiedMap:
    """What is proved of the certificate as it is read from a file."""
    write_certificate(folder / "map.proof", certificate)
    found = verify(read(folder / "map.proof"))
    assert isinstance(found, VerifiedMap)
    assert "Proved" in statement(found, certificate)
    return found


def test_balls_hold_images_and_derivatives_in_sixty_digits() -> None:
    system, rng, counts = Kinked(), np.random.default_rng(4), {0: 0, 1: 0, 2: 0}
    return_map, symbols = map_of(stated_map(system)), sp.symbols("x phi", real=True)
    pieces = list(system.pieces(type("State", (), dict(zip(("x", "phi"), symbols, strict=True)))).values())
    with mp.workdps(60), ctx.workprec(80):
        for _ in range(60):
            point, radius = rng.uniform([-1.9, 0.3], [1.9, 5.9]), 10.0 ** rng.uniform(-6, -0.8)
            box = [arb(x, radius) for x in point]
            for k, part, known in pieces_of(return_map, box):
                inner = [
                    mp.mpf(x) + mp.mpf(radius) * (2 * mp.mpf(share) - 1) for x, share in zip(point, rng.random(2), strict=True)
                ]
                here = [bool(sp.sympify(condition).subs(zip(symbols, inner, strict=True))) for condition, _ in pieces]
                if here.index(True) != k:
                    continue
                counts[k] += 1
                formulas = [sp.sympify(pieces[k][1][name]) for name in ("x", "phi")]
                for ball, jet, formula in zip(
                    hull(return_map, k, part, known), jets(return_map, k, part, known), formulas, strict=True
                ):
                    value = sp.lambdify(symbols, formula, "mpmath")(*inner)
                    assert ball.overlaps(arb(mp.nstr(value, 50)))
                    for slope, symbol in zip(jet.slopes, symbols, strict=True):
                        exact = sp.lambdify(symbols, sp.diff(formula, symbol), "mpmath")(*inner)
                        assert slope.overlaps(arb(mp.nstr(exact, 50)))
    assert min(counts.values()) > 3


def test_a_box_across_borders_is_in_all_pieces_that_it_meets_and_a_gap_is_found() -> None:
    return_map = map_of(stated_map(Kinked()))
    assert [k for k, _, _ in pieces_of(return_map, [arb(0.3, 0.1), arb(3.1, 0.2)])] == [0, 1]
    assert [k for k, _, _ in pieces_of(return_map, [arb(1, 0.25), arb(3, 0.5)])] == [1, 2]
    data = stated_map(Kinked())
    with pytest.raises(UnprovedError, match=message("verify.in-no-piece")):
        list(pieces_of(map_of(data | {"pieces": data["pieces"][:2]}), [arb(1, 0.25), arb(3, 0.5)]))


def test_a_root_is_bounded_up_to_the_border_that_its_condition_states() -> None:
    return_map = map_of(stated_map(Root()))
    found = {k: hull(return_map, k, part, known)[0] for k, part, known in pieces_of(return_map, [arb(0.005, 0.02)])}
    assert set(found) == {0, 1}
    assert found[1].contains(arb("0.2"))
    assert abs(found[1].lower() - (arb("0.2") - arb("0.025").sqrt())) < 1e-8
    data = stated_map(Root())
    image = {"letter": "R", "condition": "x > -1", "image": {"x": "mu - sqrt(x)"}}
    with pytest.raises(UnprovedError, match=message("verify.square-root")):
        [
            hull(formulas, k, part, known)
            for formulas in [map_of(data | {"pieces": [image]})]
            for k, part, known in pieces_of(formulas, [arb(0.1, 0.2)])
        ]


def test_cycles_of_the_lozi_map_are_those_of_exact_fractions(lozi: Lozi, tmp_path: Path) -> None:
    """The points of cycles by a linear system in fractions; multipliers by the product of the matrices."""
    near = nsmaps.orbit(lozi, [0.1, 0.1], 200).states[100::10]
    orbits = [nsmaps.periodic_orbit(lozi, start, 1) for start in ([0.45, 0.22], [-0.8, -0.4])]
    orbits += [orbit for period in (2, 4, 6) for orbit in nsmaps.periodic_orbits(lozi, near, period)]
    found = proved(certificate_of(lozi, orbits), tmp_path)
    assert [orbit.word for orbit in orbits] == ["".join(found.map.letters[k] for k in cycle.pieces) for cycle in found.cycles]
    assert len(orbits) > 4
    for cycle in found.cycles:
        whole = sp.eye(3)
        for piece in cycle.pieces:
            slope = sp.Rational(Fraction(lozi.a)) * (1 if found.map.letters[piece] == "L" else -1)
            whole = sp.Matrix([[slope, 1, 1], [sp.Rational(Fraction(lozi.b)), 0, 0], [0, 0, 1]]) * whole
        point = (sp.eye(2) - whole[:2, :2]).solve(whole[:2, 2])
        for ball, value in zip(cycle.states[0], point, strict=True):
            assert ball.overlaps(arb(fmpq(int(value.p), int(value.q))))
            assert ball.rad() < 1e-12
        trace, determinant = sp.N(whole[:2, :2].trace(), 40), sp.N(whole[:2, :2].det(), 40)
        split = sp.sqrt(trace**2 / 4 - determinant)
        roots = sorted((complex(trace / 2 + split), complex(trace / 2 - split)), key=abs)
        balls = sorted(cycle.multipliers, key=lambda z: float(abs(z).mid()))
        assert all(abs(acb(ball) - root) < 1e-11 * (1 + abs(root)) for ball, root in zip(balls, roots, strict=True))
        assert cycle.kind == ("stable" if abs(roots[-1]) < 1 else "unstable")


def test_claims_of_cycles_that_are_wrong_are_refused(lozi: Lozi) -> None:
    made = certificate_of(lozi, [nsmaps.periodic_orbit(lozi, [0.45, 0.22], 1)])
    return_map, (cycle,) = map_of(made.system), made.cycles
    assert verified(return_map, stated_of(json.loads(json.dumps(cycle)), return_map)).kind == "unstable"
    for change, match in (
        ({"states": [[0.46, 0.227]], "radii": [[1e-4, 1e-4]]}, message("verify.cycle-not-shown")),
        ({"radii": [[1.0, 1.0]]}, message("verify.other-pieces")),
        ({"pieces": [0]}, message("verify.other-pieces", piece="L")),
    ):
        with pytest.raises(UnprovedError, match=match):
            verified(return_map, stated_of(cycle | change, return_map))
    with pytest.raises(CertificateError, match=message("verify.not-different")):
        verify(replace(made, cycles=[cycle, cycle]))
    twice = {key: value * 2 for key, value in cycle.items()}
    with pytest.raises(CertificateError, match=message("verify.not-different")):
        verify(replace(made, cycles=[twice]))
    with pytest.raises(CertificateError, match=message("verify.trap-of-map")):
        verify(replace(made, trap={"wall": 0}))


def test_the_full_tent_has_the_entropy_of_two_branches(tmp_path: Path) -> None:
    """The entropy is log s, which is above that of each horseshoe."""
    tent = Full(s=1.99)
    starts = [float(sp.Rational(k, 129)) for k in range(1, 65, 2)]
    found = {
        orbit.word: orbit for period in (1, 2, 3, 4, 5) for orbit in nsmaps.periodic_orbits(tent, [[x] for x in starts], period)
    }
    chaos = proved(horseshoe_around(tent, list(found.values()), returns=3), tmp_path).chaos
    assert chaos is not None
    assert 0.15 < chaos.entropy < mp.log(1.99)


@pytest.mark.thorough
def test_a_horseshoe_of_the_lozi_map_and_wrong_ones(lozi: Lozi, tmp_path: Path) -> None:
    near = nsmaps.orbit(lozi, [0.1, 0.1], 200).states[100::6]
    orbits = [orbit for period in (1, 2, 4, 6) for orbit in nsmaps.periodic_orbits(lozi, near, period)]
    made = horseshoe_around(lozi, orbits, returns=2)
    chaos = proved(made, tmp_path).chaos
    assert chaos is not None
    assert 0.1 < chaos.entropy < mp.log(2)  # of a map with two pieces, each one to one
    data = json.loads(json.dumps(made.horseshoe))
    pairs, count = data["relations"], len(data["sets"])
    other = next([i, j] for i in range(count) for j in range(count) if [i, j] not in pairs)
    for wrong in (
        {"relations": [*pairs, other]},
        {"relations": [*pairs, pairs[0]]},
        {"sets": [*data["sets"], data["sets"][0]]},
    ):
        with pytest.raises(CertificateError):
            verify(replace(made, horseshoe=data | wrong))


def test_cells_that_are_forward_invariant_hold_long_orbits(tmp_path: Path) -> None:
    gentle = Lozi(a=1.4, b=0.3)
    made = prove_map(gentle, start=[0.1, 0.1], box=[[-2, 2], [-1, 1]], n_cells=128, n_parts=2)
    found = proved(made, tmp_path).closed
    assert found is not None
    inside = made.codes.reshape(128, 128) == 0
    assert found.size == inside.sum() < 700
    starts = (np.argwhere(inside) + np.random.default_rng(1).random((inside.sum(), 2))) / 128 * [4, 2] - [2, 1]
    cells = np.floor((gentle.orbits(starts, 60).image + np.array([2, 1])) / [4, 2] * 128).astype(int)
    assert inside[tuple(cells.T)].all()
    number = int(np.flatnonzero(made.codes == 0)[5])
    without = made.codes.copy()
    without[number] = 1
    with pytest.raises(CertificateError, match=message("verify.not-within-set")):
        verify(replace(made, codes=without))


def test_a_set_of_cells_on_the_circle() -> None:
    """A rotation by a third of a turn: three arcs, of cells that do not divide the turn, are carried into each other."""

    class Contracted(nsmaps.PiecewiseMap):
        coordinates = nsmaps.exact.Coordinates((nsmaps.Angle("phi"),))

        def pieces(self, y: Any) -> Any:
            return {"A": (True, {"phi": y.phi + sp.pi * sp.Rational(2, 3) + sp.sin(3 * y.phi) / 5})}

    made = prove_map(Contracted(), start=[1.0], box={"phi": (0, 2 * np.pi)}, n_cells=100, n_parts=4)
    found = verify(made)
    assert isinstance(found, VerifiedMap)
    assert found.closed is not None
    inside = np.flatnonzero(made.codes == 0)
    arcs = np.unique(np.floor((inside + 0.5) / 100 * 3))
    assert len(arcs) == 3
    assert found.closed.size < 30
    assert all(np.abs((k + 0.5) / 100 * 3 % 1 - 0.5) < 0.2 for k in inside)


def test_advice_where_no_proof_is_found(lozi: Lozi) -> None:
    with pytest.raises(ProofError, match=message("proof.larger-box")):
        prove_map(lozi, start=[0.1, 0.1], box={"x": (-1, 1), "y": (-0.5, 0.5)}, n_cells=16)
    with pytest.raises(ProofError, match=message("proof.no-box")):
        prove_map(lozi, start=[0.1, 0.1])
    with pytest.raises(ProofError, match=message("proof.no-cycle-near", number=3)):
        prove_map(lozi, cycles=[([0.1, 0.1], 3)])


def test_a_cycle_that_is_stated_twice_is_refused_by_the_command(tmp_path: Path) -> None:
    text = "system: lozi\nproof: {start: {x: 0.6, y: 0.2}, cycles: [{start: {x: 0.6, y: 0.2}}]}\n"
    (tmp_path / "twice.yaml").write_text(text)
    made = CliRunner().invoke(app, ["prove", str(tmp_path / "twice.yaml"), "--out", str(tmp_path / "twice.proof"), "-q"])
    assert "refused: cycles are not shown to differ, at " in made.output
    assert made.exit_code == 1
