"""Rotation numbers and their steps: exact windows of gap maps and plateaux, tongues in closed form, a golden rotation."""

from fractions import Fraction

import numpy as np
import pytest
from messages import message
from nsmaps_border_collision import BorderCollision1
from nsmaps_circle_map import CircleMap, GapCircleMap, PlateauCircleMap
from piecewise_references import number, rows

import nsmaps
from nsmaps.dynamics.diagrams.windows import windows
from nsmaps.dynamics.rotation.staircase import farey_parents
from nsmaps.errors import NsmapsError
from nsmaps.exact import Along

GOLDEN = (5**0.5 - 1) / 2


def test_a_cycle_has_a_fraction_and_a_rotation_its_angle():
    found = nsmaps.rotation_number(BorderCollision1(a_L=0.5, a_R=0.5, mu=0.3, jump=-1.0), [0.1])
    assert (found.fraction, found.counted, sorted(found.cycle.words)) == (Fraction(2, 5), "R", ["L", "L", "L", "R", "R"])
    plateau = nsmaps.rotation_number(PlateauCircleMap(Omega=0.4, w=0.5), [0.1])
    assert (plateau.fraction, plateau.counted, plateau.cycle.multipliers.tolist()) == (Fraction(2, 3), "phi", [0])
    rigid = nsmaps.rotation_number(CircleMap(Omega=GOLDEN, K=0.0), [0.1], n_returns=2000)
    assert rigid.fraction is None
    assert abs(rigid.value - GOLDEN) <= rigid.error < 1e-15
    smooth = nsmaps.rotation_number(CircleMap(Omega=GOLDEN, K=0.9), [0.1])
    lifted = nsmaps.orbit(CircleMap(Omega=GOLDEN, K=0.9), [0.1], 100_000)  # within a turn of n times the rotation number
    assert abs(smooth.value - lifted.turns.sum() / 100_000) < 2e-5
    assert smooth.error < 1e-13
    assert str(found).startswith("R: 2/5, of LLRLR, period 5, stable")
    assert str(smooth).startswith(f"phi: {smooth.value:.12g} +- ")


def test_what_is_counted_is_named_or_known():
    gap = BorderCollision1(a_L=0.5, a_R=0.5, mu=0.3, jump=-1.0)
    assert nsmaps.rotation_number(gap, {"x": 0.1}, counted="L").fraction == Fraction(3, 5)
    with pytest.raises(NsmapsError, match=message("dynamics.counted", name="Q", names="L, R")):
        nsmaps.rotation_number(gap, [0.1], counted="Q")
    with pytest.raises(NsmapsError, match=message("dynamics.orbit-ends", state="[0.1]")):
        nsmaps.rotation_number(gap.at(a_R=3.0, a_L=3.0), [0.1])


def check(found, expected, names):
    """Steps have the borders of a table of exact numbers, to rounding."""
    known = {plateau.rotation: plateau for plateau in found.plateaux}
    assert found.missing == ()
    assert set(expected) <= set(known)
    for rotation, (low, high) in expected.items():
        step = known[rotation]
        assert (step.low.value, step.high.value) == pytest.approx((low, high), abs=3e-15)
        assert {step.low.kind, step.high.kind} <= names
        assert max(abs(step.low.value - low) - step.low.precision, abs(step.high.value - high) - step.high.precision) <= 0


def table(entries, largest):
    """Rotation numbers with the borders of their steps, of the periods up to the largest."""
    found = {Fraction(entry[0]): (number(entry[1]), number(entry[2])) for entry in entries}
    return {rotation: ends for rotation, ends in found.items() if 1 < rotation.denominator <= largest}


@pytest.mark.parametrize("period", [5, pytest.param(12, marks=pytest.mark.thorough)])
def test_a_map_with_a_gap_adds_periods(period):
    for case in rows("M3")[: None if period > 5 else 1]:
        gap = BorderCollision1(a_L=number(case["a"]), a_R=number(case["a"]), mu=0.5, jump=-1.0)
        found = nsmaps.staircase(gap, "mu", (-0.05, 1.05), [0.1], max_period=period)
        expected = table(case["windows"], period)
        check(found, expected, {"border collision"})
        words = {Fraction(entry[0]): entry[3] for entry in case["windows"]}
        for rotation in expected:
            assert found.plateau(rotation).word in 2 * words[rotation]
        added = {step.rotation: (low, high) for step, low, high in found.additions()}
        assert set(added) >= set(expected)
        for step, (low, high) in added.items():
            assert step == Fraction(low.rotation.numerator + high.rotation.numerator, low.cycle.period + high.cycle.period)
            assert low.high.value < found.plateau(step).low.value < high.low.value


@pytest.mark.parametrize("period", [4, pytest.param(10, marks=pytest.mark.thorough)])
def test_plateaux_and_gaps_on_the_circle(period):
    for case in rows("M5")["plateau"][: None if period > 5 else 1]:
        map_of = Along(PlateauCircleMap(Omega=0.3, w=number(case["w"])), "Omega")
        check(
            nsmaps.staircase(map_of, "p", (0.0, 0.99), [0.1], max_period=period),
            table(case["windows"], period),
            {"border collision"},
        )
    for case in rows("M5")["gap"] if period > 5 else ():
        map_of = Along(GapCircleMap(b=0.6, a=number(case["a"])), "b")
        check(
            nsmaps.staircase(map_of, "p", (0.1, 0.9999), [0.1], max_period=period),
            table(case["windows"], period),
            {"border collision"},
        )


def test_tongues_end_at_folds():
    """Rotation number 0 for |Omega| <= K/(2 pi); 1 is that shifted by a turn."""
    found = nsmaps.staircase(CircleMap(Omega=0.3, K=0.9), "Omega", (-0.2, 1.2), [0.1], max_period=2)
    edge = 0.9 / (2 * np.pi)
    assert [(str(step.rotation), step.low.kind, step.high.kind) for step in found.plateaux] == [
        (name, "fold", "fold") for name in ("0", "1/2", "1")
    ]
    ends = [end for name in "01" for end in (found.plateau(name).low.value, found.plateau(name).high.value)]
    assert ends == pytest.approx([-edge, edge, 1 - edge, 1 + edge], abs=1e-11)
    with pytest.raises(NsmapsError, match=message("dynamics.no-step", number="1/7", known="0, 1/2, 1")):
        found.plateau("1/7")
    assert [farey_parents(Fraction(name)) for name in ("3/7", "1/5", "2")] == [
        (Fraction(2, 5), Fraction(1, 2)),
        (Fraction(0), Fraction(1, 4)),
        None,
    ]


def test_windows_of_a_diagram_have_their_rotation_number():
    """Borders a/(1 + a) and so on of the map with a gap, of an angle from 1/6 to 1/3."""
    gap, plateau = BorderCollision1(a_L=0.5, a_R=0.5, mu=0.3, jump=-1.0), PlateauCircleMap(Omega=0.3, w=0.5)
    for map_of, (first, last), expected in (
        (Along(gap, "mu"), (0.1, 0.7), {"1/3": (1 / 7, 2 / 7), "1/2": (1 / 3, 2 / 3)}),
        (Along(plateau, "Omega"), (0.05, 0.35), {"1/2": (1 / 6, 1 / 3)}),
    ):
        values = np.linspace(first, last, 31)
        diagram = nsmaps.bifurcation_diagram(map_of, "p", values, [0.1], n_returns=20, transient=200)
        found = {window.rotation: window for window in windows(diagram, map_of, np.array([0.1]), 200)}
        for rotation, (low, high) in expected.items():
            assert (found[rotation].low.value, found[rotation].high.value) == pytest.approx((low, high), abs=1e-14)
