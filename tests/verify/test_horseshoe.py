"""Horseshoes: proved ones, wrong ones that are refused, images against mpmath in 60 digits, entropies against closed forms."""

import json
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from flint import arb, ctx
from messages import message
from nsmaps_bouncing_ball import BouncingBall

import nsmaps
from nsmaps.errors import ProofError
from nsmaps.proof.horseshoe import certificate_of, prove_horseshoe
from nsmaps.verify.cells import CertificateError
from nsmaps.verify.certificate import Certificate, read, statement, verify, write_certificate
from nsmaps.verify.flights import next_impact, next_impacts
from nsmaps.verify.formula import UnprovedError, system_of
from nsmaps.verify.horseshoe import chaos_of, covers, entropy, horseshoe_of

SLOWEST, LONGEST = 0.07, 4  #: impact and period of the cycles without impacts on T around which the small horseshoe lies


@pytest.fixture(scope="module")
def small(pair: Callable[..., Any], reference: Callable[[str], Any]) -> Certificate:
    system = pair(0.35)
    starts = [
        (np.array(row["state"], float), len(row["words"].split()))
        for row in reference("cycles")
        if "T" not in row["words"] and float(row["state"][0]) > SLOWEST
    ]
    return certificate_of(system, [nsmaps.periodic_orbit(system, x, period) for x, period in starts if period <= LONGEST])


def refused(certificate: Certificate, data: dict[str, Any], match: str) -> None:
    """A statement is refused."""
    with pytest.raises((UnprovedError, ValueError), match=match):
        chaos_of(system_of(dict(certificate.system)), horseshoe_of(data, 2))


def test_a_horseshoe_is_proved_from_its_file(small: Certificate, tmp_path: Path, reference: Callable[[str], Any]) -> None:
    write_certificate(tmp_path / "small.proof", small)
    found = verify(read(tmp_path / "small.proof"))
    assert found.chaos is not None
    assert found.shares == ()
    covered = np.zeros((len(found.chaos.stated.sets),) * 2)
    covered[tuple(zip(*found.chaos.stated.relations, strict=True))] = 1
    radius = max(abs(np.linalg.eigvals(covered)))
    assert abs(np.log(radius) - found.chaos.entropy) < 1e-12
    assert f"is at least {str(found.chaos.entropy)[:8]}" in statement(found, small)
    periods = [len(row["words"].split()) for row in reference("cycles")]
    for n in range(1, 7):  # each periodic sequence is that of a cycle, and no two have the same
        known = sum(period for period in periods if n % period == 0)
        assert np.trace(np.linalg.matrix_power(covered, n)) <= known


def test_changed_numbers_and_relations_are_refused(small: Certificate) -> None:
    data = json.loads(json.dumps(small.horseshoe))
    chaos_of(system_of(dict(small.system)), horseshoe_of(data, 2))
    pairs, count = data["relations"], len(data["sets"])
    other = next([i, j] for i in range(count) for j in range(count) if [i, j] not in pairs)
    refused(small, data | {"relations": [*pairs, other]}, message("verify.not-covered"))
    refused(small, data | {"relations": [*pairs, pairs[0]]}, message("verify.relations"))
    refused(small, data | {"relations": pairs[:1]}, message("verify.no-chaos"))
    refused(small, data | {"sets": [*data["sets"], data["sets"][0]]}, message("verify.not-disjoint"))
    for change, said in (
        (lambda one: one["centre"].__setitem__(0, one["centre"][0] + 0.01), message("verify.not-covered")),
        (lambda one: one.__setitem__("walls", [1, 0, 0]), message("verify.horseshoe-impacts", word="[1, 0, 0]")),
    ):
        wrong = deepcopy(data)
        change(wrong["sets"][pairs[0][1]])
        refused(small, wrong, said)
    with pytest.raises(CertificateError):
        verify(Certificate(small.about, dict(small.system) | {"restitution": ["0.51", "0"]}, horseshoe=data))


@pytest.mark.parametrize(("column", "factor"), [(0, 30.0), (1, 0.05)])
def test_a_set_that_is_too_long_or_too_low_is_not_covered(small: Certificate, column: int, factor: float) -> None:
    system, stated = system_of(dict(small.system)), horseshoe_of(small.horseshoe, 2)
    assert stated.relations
    for i, j in stated.relations[:3]:
        (a, b), (c, d) = stated.sets[j].matrix
        matrix = ((factor * a, b), (factor * c, d)) if column == 0 else ((a, factor * b), (c, factor * d))
        assert covers(system, 0, stated.sets[i], [stated.sets[j]]) > 0
        with pytest.raises(UnprovedError, match=message("verify.not-covered")):
            covers(system, 0, stated.sets[i], [stated.sets[j]._replace(matrix=matrix)])


def landed(wall: int, phase: Any, speed: Any, guess: Any, hit: int) -> tuple[Any, Any]:
    """The impact of the VI pair near a guessed phase: z'' = g + cos(pi t) with walls at 0.175 and -0.175."""
    gravity, at = mp.mpf("0.1245") * mp.mpf("9.8") * mp.sin(mp.pi / 3) / 5, [mp.mpf("0.175"), -mp.mpf("0.175")]
    t0, drift = phase / mp.pi, (-1, 1)[wall] * speed / 2 - mp.sin(phase) / mp.pi
    place = lambda t: (  # noqa: E731
        at[wall] + drift * (t - t0) + gravity * (t - t0) ** 2 / 2 - (mp.cos(mp.pi * t) - mp.cos(phase)) / mp.pi**2
    )
    end = mp.findroot(lambda t: place(t) - at[hit], guess / mp.pi, tol=1e-100)
    return mp.pi * end, (1, -1)[hit] * (drift + gravity * (end - t0) + mp.sin(mp.pi * end) / mp.pi)


def test_images_of_parts_hold_those_of_sixty_digits(small: Certificate) -> None:
    system, rng = system_of(dict(small.system)), np.random.default_rng(7)
    with mp.workdps(60), ctx.workprec(80):
        for each in horseshoe_of(small.horseshoe, 2).sets:
            matrix, centre = tuple(tuple(map(arb, row)) for row in each.matrix), tuple(map(arb, each.centre))
            _, end, slope = next_impacts(system, 0, centre, matrix, (arb(0, 0.01), arb(0, 0.01)), len(each.walls))
            for _ in range(4):
                way, wall = [mp.mpf(float(x)) for x in rng.uniform(-0.01, 0.01, 2)], 0
                state = tuple(
                    c + mp.mpf(a) * way[0] + mp.mpf(b) * way[1] for c, (a, b) in zip(each.centre, each.matrix, strict=True)
                )
                for hit in each.walls:
                    guess = next_impact(system, wall, *(arb(mp.nstr(x, 30)) for x in state)).phase
                    state, wall = landed(wall, *state, mp.mpf(float(guess.mid())), hit), hit
                for k in (0, 1):
                    image = end[k] + slope[k][0] * arb(mp.nstr(way[0], 40)) + slope[k][1] * arb(mp.nstr(way[1], 40))
                    assert image.overlaps(arb(mp.nstr(state[k], 40)))
                    assert image.rad() < 0.01


@pytest.mark.thorough
def test_an_iterate_has_a_horseshoe_where_one_return_stretches_little(pair: Callable[..., Any]) -> None:
    system, fast, phases = pair(0.26), 0.6563, {0.1755: 2, 0.2454: 4, 0.2728: 6, 0.2838: 6, 0.2571: 8, 0.2379: 10, 0.2641: 10}
    cycles = [nsmaps.periodic_orbit(system, [fast, phase], period) for phase, period in phases.items()]
    made = certificate_of(system, cycles, returns=4)
    chaos = chaos_of(system_of(dict(made.system)), horseshoe_of(made.horseshoe, 2))
    assert {each.walls for each in chaos.stated.sets} == {(1, 0) * 4}
    assert all(0.65 < each.centre[1] < 0.78 for each in chaos.stated.sets)
    once = entropy(len(chaos.stated.sets), chaos.stated.relations)
    assert chaos.entropy == pytest.approx(once / 4, rel=1e-12)
    refused(made, dict(made.horseshoe) | {"returns": 3}, "3 returns have the impacts")


@pytest.mark.parametrize(
    ("name", "returns", "least"), [("chaos", 4, 0.1358), pytest.param("transient", 1, 1.1092, marks=pytest.mark.thorough)]
)
def test_kept_certificates_of_chaos_are_verified(name: str, returns: int, least: float) -> None:
    found = verify(read(Path(__file__).parents[2] / "docs" / "certificates" / f"{name}.proof"))
    assert found.chaos is not None
    assert found.chaos.entropy > least
    assert found.chaos.stated.returns == returns


@pytest.mark.thorough
def test_a_ball_that_bounces_has_a_horseshoe() -> None:
    ball = BouncingBall(Gamma=2.2)
    made = prove_horseshoe(ball, [[0.5, 12], [0, 2 * np.pi]], 4, depth=2)
    found = verify(made)
    assert found.chaos is not None
    assert found.chaos.entropy > 0.39
    assert {each.walls for each in found.chaos.stated.sets} == {(0,)}


def test_entropies_are_those_of_closed_forms() -> None:
    golden = entropy(2, [(0, 0), (0, 1), (1, 0)])
    assert 0 <= float(mp.log(mp.phi)) - golden < 1e-12
    assert 0 <= np.log(2) - entropy(3, [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0)]) < 1e-12
    assert 0 <= np.log(2) / 2 - entropy(3, [(0, 1), (0, 2), (1, 0), (2, 0)]) < 1e-12  # of period two
    for relations in ([(0, 1), (1, 0)], [(0, 1), (1, 2)]):
        with pytest.raises(UnprovedError, match=message("verify.no-chaos")):
            entropy(3, relations)


def test_one_saddle_is_no_horseshoe(pair: Callable[..., Any]) -> None:
    system = pair(0.35)
    with pytest.raises(ProofError, match=message("proof.no-chaos")):
        certificate_of(system, [nsmaps.periodic_orbit(system, [0.28177, 2.91844])])
    with pytest.raises(ProofError, match=message("proof.no-unstable-cycle")):
        certificate_of(system, [nsmaps.periodic_orbit(system, [0.83339, 0.36361])])
