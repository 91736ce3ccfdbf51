"""Cycles that are proved, against 40-digit cycles, closed forms and mpmath in 60 digits; wrong statements are refused."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from flint import arb
from messages import message
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_impact_oscillator import ImpactOscillator

import nsmaps
from nsmaps.errors import ProofError
from nsmaps.proof.cycles import certificate_of, impacts_of, stated
from nsmaps.proof.formula import equation_of
from nsmaps.verify.cells import CertificateError
from nsmaps.verify.certificate import read, statement, verify, write_certificate
from nsmaps.verify.cycles import Cycle, distinct, stated_of, verified
from nsmaps.verify.formula import System, UnprovedError, system_of

GRAZING = 95  #: the cycle with the slowest impact, v = 0.0019
SOME = (0, 2, 4, 16, GRAZING, 243)


def holds(ball: arb, value: Any) -> bool:
    """Whether a ball holds a number of mpmath, or of digits, with the error of its last digit."""
    return bool(ball.overlaps(arb(value if isinstance(value, str) else mp.nstr(value, 40))))


def of_row(system: Any, row: dict[str, Any]) -> Any:
    """The periodic orbit of a row of the reference, in floats."""
    period = len(row["words"].split())
    return nsmaps.periodic_orbit(system, nsmaps.orbit(system, np.array(row["state"], float), period - 1).states, period)


def of_rows(system: Any, rows: list[dict[str, Any]]) -> tuple[System, list[dict[str, Any]], list[Cycle]]:
    """The equation, the statements as they are read from a file, and the cycles."""
    equation = system_of(equation_of(system))
    statements = [json.loads(json.dumps(stated(system, equation, of_row(system, row)))) for row in rows]
    return equation, statements, [verified(equation, stated_of(each, 2)) for each in statements]


@pytest.fixture(scope="module")
def some(pair: Callable[..., Any], reference: Callable[[str], Any]) -> Any:
    rows = [reference("cycles")[i] for i in SOME]
    return (rows, *of_rows(pair(0.35), rows))


def are_known(rows: list[dict[str, Any]], cycles: list[Cycle]) -> None:
    """Compare cycles with 40 digits."""
    for row, cycle in zip(rows, cycles, strict=True):
        speed, phase = row["state"]
        assert holds(cycle.states[0][0], phase)
        assert holds(cycle.states[0][1], speed)
        assert cycle.states[0][1].rad() < 1e-12
        assert cycle.multipliers is not None
        large, small = row["multipliers"]
        assert cycle.multipliers[0].overlaps(arb(large) * (1 + arb(0, 1e-15)))
        assert cycle.multipliers[1].overlaps(arb(small) * (1 + arb(0, 1e-15)))
        assert cycle.multipliers[0].rad() < 1e-4 * abs(large)
        assert cycle.kind == ("stable" if abs(large) < 1 else "saddle")
        assert len(cycle.walls) == len(row["words"].replace(" ", "")) - len(row["words"].split())


def test_cycles_from_the_other_wall_hold_the_same_forty_digits(pair: Callable[..., Any], reference: Callable[[str], Any]) -> None:
    """The impacts of a cycle in the order of the map of the other wall: the same multipliers, its first state among them."""
    base = pair(0.35)
    other = base.at(base="T")
    rows = [row for row in reference("cycles")[:40] if "T" in row["words"]][::12]
    assert rows
    for row in rows:
        walls, states = impacts_of(base, of_row(base, row))
        phase, speed = states[walls.index(1)]
        orbit = nsmaps.periodic_orbit(other, [speed, phase], walls.count(1))
        equation = system_of(equation_of(other))
        cycle = verified(equation, stated_of(json.loads(json.dumps(stated(other, equation, orbit))), 2))
        assert sorted(cycle.walls) == sorted(1 - wall for wall in walls)
        first = [k for k, wall in enumerate(cycle.walls) if wall == 1 and holds(cycle.states[k][0], row["state"][1])]
        assert len(first) == 1
        assert holds(cycle.states[first[0]][1], row["state"][0])
        assert cycle.multipliers is not None
        large, small = row["multipliers"]
        assert cycle.multipliers[0].overlaps(arb(large) * (1 + arb(0, 1e-15)))
        assert cycle.multipliers[1].overlaps(arb(small) * (1 + arb(0, 1e-15)))


def test_cycles_of_the_pair_hold_their_forty_digits(some: Any) -> None:
    rows, _, _, cycles = some
    are_known(rows, cycles)
    distinct(cycles)


@pytest.mark.thorough
def test_all_cycles_of_the_pair_are_proved(reference: Callable[[str], Any]) -> None:
    """By the certificate that is kept: all 244 hold their 40 digits, are different, and one of them is stable."""
    found = verify(read(Path(__file__).parents[2] / "docs" / "certificates" / "cycles.proof"))
    are_known(reference("cycles"), list(found.cycles))
    assert [cycle.kind for cycle in found.cycles].count("stable") == 1


def test_the_same_cycle_is_not_counted_twice(some: Any) -> None:
    _, equation, statements, cycles = some
    saddle = statements[2]
    turned = {key: [*saddle[key][1:], saddle[key][0]] for key in saddle}
    with pytest.raises(UnprovedError, match=message("verify.not-different")):
        distinct([*cycles, verified(equation, stated_of(turned, 2))])
    twice = {key: statements[1][key] * 2 for key in saddle}
    twice["radii"] = (np.array(twice["radii"]) / 100).tolist()
    with pytest.raises(UnprovedError, match=message("verify.not-different")):
        distinct([verified(equation, stated_of(twice, 2))])


def test_one_impact_a_period_of_the_bouncing_ball() -> None:
    ball = BouncingBall(Gamma=1.2)
    found = nsmaps.periodic_orbit(ball, [4.2, 0.5])
    equation = system_of(equation_of(ball))
    cycle = verified(equation, stated_of(stated(ball, equation, found), 1))
    with mp.workdps(60):
        r, gamma = mp.mpf("0.5"), mp.mpf("1.2")
        cosine = mp.pi * (1 - r) / (gamma * (1 + r))
        phase, speed = mp.acos(cosine), 2 * mp.pi / (1 + r)
        trace = 1 + r**2 - (1 + r) ** 2 * gamma * mp.sqrt(1 - cosine**2)
        assert holds(cycle.states[0][0], phase)
        assert holds(cycle.states[0][1], speed)
        assert holds(cycle.trace, trace)
        assert holds(cycle.determinant, r**2)
    assert (cycle.kind, cycle.turns) == ("stable", 1)
    assert cycle.states[0][0].rad() < 1e-13
    assert cycle.multipliers is None  # they are complex


def one_impact(zeta: Any, w: Any, amplitude: Any, wall: Any, r: Any, guess: Any) -> tuple[Any, Any]:
    """Speed and phase of one impact a period of the oscillator, from complex roots of its characteristic equation."""
    root, gain = mp.sqrt(mp.mpc(zeta**2 - 1)), amplitude / (1 - w**2 + 2j * zeta * w)
    fast, slow, period = -zeta - root, -zeta + root, 2 * mp.pi / w

    def missed(v: Any, phi: Any) -> list[Any]:
        x, u = wall - mp.re(gain * mp.expj(phi)), -r * v - mp.re(1j * w * gain * mp.expj(phi))
        a, b = (u - fast * x) / (slow - fast), (slow * x - u) / (slow - fast)
        end = [mp.re(slow**k * a * mp.exp(slow * period) + fast**k * b * mp.exp(fast * period)) for k in (0, 1)]
        return [end[0] - x, end[1] + mp.re(1j * w * gain * mp.expj(phi)) - v]

    return tuple(mp.findroot(missed, guess, tol=1e-100))


def test_one_impact_a_period_of_the_oscillator() -> None:
    oscillator = ImpactOscillator(zeta=0.05, w=0.81, A=0.7, wall=0.6)
    found = nsmaps.periodic_orbit(oscillator, attracted(oscillator))
    equation = system_of(equation_of(oscillator))
    cycle = verified(equation, stated_of(stated(oscillator, equation, found), 1))
    with mp.workdps(60):
        zeta, w, r = mp.mpf("0.05"), mp.mpf("0.81"), mp.mpf("0.9")
        speed, phase = one_impact(zeta, w, mp.mpf("0.7"), mp.mpf("0.6"), r, tuple(found.states[0]))
        assert holds(cycle.states[0][0], phase)
        assert holds(cycle.states[0][1], speed)
        assert holds(cycle.determinant, r**2 * mp.exp(-4 * mp.pi * zeta / w))
    assert cycle.states[0][0].rad() < 1e-12
    assert cycle.kind == "stable"


def attracted(system: Any) -> Any:
    """The end of an orbit."""
    return nsmaps.orbit(system, [0.5, 1.0], 400).states[-1]


def test_wrong_statements_are_refused(some: Any) -> None:
    _, equation, statements, _ = some
    entry = statements[1]
    (phase, speed), (wide, high) = entry["states"][0], entry["radii"][0]
    beside = [[phase + 3 * wide, speed + 3 * high], *entry["states"][1:]]
    wrong = [
        {**entry, "states": beside},
        {**entry, "walls": entry["walls"][::-1]},
        {**entry, "radii": [[1e-17, 1e-17]] * 2},
        {**entry, "radii": [[0.4, 0.4]] * 2},
    ]
    for data in wrong:
        with pytest.raises(UnprovedError):
            verified(equation, stated_of(data, 2))


def narrow(entry: dict[str, Any]) -> dict[str, Any]:
    """A statement with radii of about 1e-9."""
    radii = np.array(entry["radii"])
    return {**entry, "radii": (radii * 1e-9 / radii.max()).tolist()}


def test_a_changed_bit_beyond_the_radii_is_refused(some: Any) -> None:
    _, equation, statements, _ = some
    entry = narrow(statements[1])
    verified(equation, stated_of(entry, 2))
    for bit in (51, 40, 30):
        for column in (0, 1):
            states = np.array(entry["states"])
            states.view(np.int64)[1, column] ^= 1 << bit
            with pytest.raises(UnprovedError):
                verified(equation, stated_of({**entry, "states": states.tolist()}, 2))


def test_cycles_of_another_system_are_refused(some: Any, pair: Callable[..., Any]) -> None:
    entry = stated_of(narrow(some[2][1]), 2)
    for d in (0.349, 0.35 + 1e-7):
        with pytest.raises(UnprovedError):
            verified(system_of(equation_of(pair(d))), entry)


def test_an_error_planted_in_the_search_is_found(some: Any, pair: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    rows, equation, _, _ = some
    walls, states = impacts_of(pair(0.35), of_row(pair(0.35), rows[1]))
    monkeypatch.setattr("nsmaps.proof.cycles.impacts_of", lambda *_: (walls[::-1], states))
    with pytest.raises(ProofError, match=message("proof.cycle-not-shown")):
        stated(pair(0.35), equation, of_row(pair(0.35), rows[1]))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"radius": 1.0}, message("verify.cycle-keys", given=re.compile(".*'radius'.*"))),
        ({"walls": [0]}, message("verify.cycle-lists")),
        ({"walls": [0, 2]}, message("verify.cycle-walls", last=1)),
        ({"walls": [0, True]}, message("verify.cycle-walls", last=1)),
        ({"states": [[1.0, 2.0], [1.0]]}, message("verify.cycle-state")),
        ({"states": [[1.0, 2.0], [1, "2"]]}, message("verify.cycle-state")),
        ({"states": [[1.0, 2.0], [float("nan"), 2.0]]}, message("verify.cycle-radii")),
        ({"radii": [[1e-9, 1e-9], [0.0, 1e-9]]}, message("verify.cycle-radii")),
        ({"radii": [[1e-9, 1e-9], [1e-9, 9.0]]}, message("verify.cycle-radii")),
    ],
)
def test_unreadable_statements_say_what_is_wrong(some: Any, change: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        stated_of({**some[2][1], **change}, 2)
    with pytest.raises(ValueError, match=message("verify.cycle-keys")):
        stated_of(None, 2)


def test_a_certificate_of_cycles_alone(pair: Callable[..., Any], reference: Callable[[str], Any], tmp_path: Path) -> None:
    orbits = [of_row(pair(0.35), row) for row in reference("cycles")[:3]]
    made = certificate_of(pair(0.35), orbits)
    write_certificate(tmp_path / "a.proof", made)
    found = verify(read(tmp_path / "a.proof"))
    text = statement(found, made)
    assert "3 different cycles" in text
    assert "1 stable, 2 saddle, 0 open" in text
    assert "converge" not in text
    for wrong in ([], [*made.cycles, made.cycles[0]], [{**made.cycles[0], "walls": [1]}], [None], {"a": 1}):
        with pytest.raises(CertificateError):
            verify(replace(made, cycles=wrong))
    with pytest.raises(CertificateError, match=message("verify.not-readable", error="TypeError")):
        verify(replace(made, codes=np.zeros(3, np.uint16)))
