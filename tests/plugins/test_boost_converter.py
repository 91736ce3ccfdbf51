"""The boost converter: references M8, closed forms at other parameters, and the same circuit as a system with modes."""

import math
from fractions import Fraction

import numpy as np
import pytest
from nsmaps_boost_converter import BoostConverter
from piecewise_references import cyclic, number, rows

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.dynamics.search import periodic_orbits_by_word
from nsmaps.proof.horseshoe import prove_horseshoe
from nsmaps.proof.maps.prove import prove_map
from nsmaps.symbolic.kneading import topological_entropy
from nsmaps.testing import check_system
from nsmaps.verify.certificate import verify

TABLE = rows("M8")
ROWS = [row for name in ("integer_alpha", "other_alpha", "compensation") for row in TABLE[name]]
FIXED = [row for row in ROWS if "fixed_point" in row]
CYCLES = [(row, orbit) for row in ROWS for orbit in row.get("periodic_orbits", ())]
RETURNS = 50_000  #: of a run whose exponents are compared
ROUNDED = 1 + 1e-9  #: times alpha: multiplied by 2 or 4, doubles lose no digit at their end, and orbits end on whole numbers


def system_of(row):
    """The converter of a row in continuous conduction: the current is above zero where x = I_ref - i is below alpha."""
    alpha, ramp = (float(row["parameters"].get(name, "0")) for name in ("alpha", "mc"))
    return BoostConverter(alpha=alpha, m_c=ramp, I_ref=alpha + 1)


def named(value):
    if not isinstance(value, dict):
        return None
    return value.get("word") or ", ".join(f"{name} = {number}" for name, number in value["parameters"].items())


@pytest.mark.parametrize("row", FIXED, ids=named)
def test_a_fixed_point(row):
    system, x = system_of(row), number(row["fixed_point"])
    orbit = nsmaps.periodic_orbit(system, [system.I_ref - x + 1e-3])
    assert (orbit.words, orbit.stable) == (("S",), row["stable"])
    assert system.I_ref - orbit.states[0, 0] == pytest.approx(x, rel=1e-12)
    assert orbit.multipliers[0].real == pytest.approx(number(row["multiplier"]), rel=1e-12)


@pytest.mark.parametrize(("row", "cycle"), CYCLES, ids=named)
def test_a_cycle(row, cycle):
    system, x = system_of(row), number(cycle["point"])
    orbit = nsmaps.periodic_orbit(system, [system.I_ref - x + 1e-5], cycle["period"])
    assert ("".join(orbit.words), orbit.exists) == (cycle["word"], True)
    assert system.I_ref - orbit.states[0, 0] == pytest.approx(x, rel=1e-12)
    assert orbit.multipliers[0].real == pytest.approx(number(cycle["multiplier"]), rel=1e-12)


def test_there_are_no_other_cycles():
    """All words up to period 5 at alpha = 2.5."""
    (row,) = [row for row in TABLE["other_alpha"] if row["parameters"]["alpha"] == "2.5"]
    found = sorted(cyclic(orbit.word) for orbit in periodic_orbits_by_word(system_of(row), 5))
    assert found == sorted(cyclic(cycle["word"]) for cycle in row["periodic_orbits"] if cycle["period"] <= 5)


@pytest.mark.parametrize("row", TABLE["integer_alpha"], ids=named)
def test_topological_entropies(row):
    """The largest root of x^m = x^(m-1) + ... + 1."""
    m = int(row["parameters"]["alpha"])
    growth = float(row["growth"])
    assert max(np.roots([1, *[-1] * m]).real) == pytest.approx(growth, rel=1e-13)
    assert topological_entropy(system_of(row)) == pytest.approx(math.log(growth), rel=1e-12)
    assert float(row["topological_entropy"]) == pytest.approx(math.log(growth), rel=1e-15)


@pytest.mark.parametrize("row", [row for row in ROWS if "lyapunov_exact" in row or row.get("lyapunov")], ids=named)
def test_exponents_of_long_orbits(row):
    """2 ln m/(m + 1) for whole numbers m, where 2/(m + 1) of the returns switch; other values of long runs."""
    system = system_of(row)
    alpha, start = system.alpha, [system.I_ref - 0.3141592653]
    found = nsmaps.lyapunov(system.at(alpha=alpha * ROUNDED), starts=start, n_returns=RETURNS)
    share = (nsmaps.orbit(system.at(alpha=alpha * ROUNDED), start, RETURNS).words == "S").mean()
    if "lyapunov_exact" in row:
        value, error, switching = float(row["lyapunov_exact"]), 0.0, number(row["share_of_switching"])
        assert value == pytest.approx(2 * math.log(alpha) / (alpha + 1), rel=1e-15)
    else:
        known = row["lyapunov"]
        value, error = float(known["values"][0]), float(known["standard_errors"][0])
        switching = float(known["share_of_R"])
    assert abs(found.exponents[0] - value) < 5 * math.hypot(found.error[0], error)
    assert share == pytest.approx(switching, abs=5e-3)


@pytest.mark.parametrize("row", [row for row in ROWS if row.get("stable")], ids=named)
def test_exponents_of_stable_fixed_points(row):
    system = system_of(row)
    found = nsmaps.lyapunov(system, starts=[system.I_ref - 0.3], n_returns=100).exponents[0]
    assert found == pytest.approx(math.log(abs(Fraction(row["multiplier"]))), rel=1e-12)
    if "exponent" in row:
        assert found == pytest.approx(float(row["exponent"]), rel=1e-12)


@pytest.mark.parametrize("row", [*TABLE["compensation"], {"parameters": {"alpha": "3.7"}}], ids=named)
def test_compensation_is_enough_above_its_critical_slope(row):
    """The doubling in m_c at (alpha - 1)/2, and in alpha, without compensation, at 1."""
    system = system_of(row).at(m_c=2.0)
    critical = (system.alpha - 1) / 2
    if "critical_mc" in row:
        assert critical == Fraction(row["critical_mc"])
    orbit = nsmaps.periodic_orbit(system, [system.I_ref - 0.9])
    (event,) = nsmaps.continue_branch(system, "m_c", orbit, 2.0, (0, 2.5), direction="down", step=0.5).events
    assert (event.kind, event.value) == ("period doubling", pytest.approx(critical, rel=1e-12))
    plain = system.at(alpha=0.5, m_c=0.0)
    orbit = nsmaps.periodic_orbit(plain, [plain.I_ref - 0.3])
    events = nsmaps.continue_branch(plain, "alpha", orbit, 0.5, (0.1, 1.5), direction="up", step=0.5).events
    assert events[0].kind == "period doubling"
    assert events[0].value == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize(("alpha", "k"), [(2.5, 0), (2.5, 1), (2.5, 2), (5.3, 4)])
def test_in_discontinuous_conduction_cycles_begin_at_zero(alpha, k):
    """k periods on and one with a fall to zero, for k < I_ref <= (k + 1) alpha/(1 + alpha) without compensation."""
    last = (k + 1) * alpha / (1 + alpha)
    for reference, there in ((k + 1e-9, True), (last - 1e-9, True), (last + 1e-9, False)):
        words = "".join(nsmaps.orbit(BoostConverter(alpha=alpha, I_ref=reference), [0.0], k + 1).words)
        assert (words == "N" * k + "Z") == there


def test_above_the_reference_it_is_off_throughout():
    returns = BoostConverter(alpha=1.5, I_ref=2.0, rise=0.5).first_return([[2.5], [3.0], [2.0]])
    assert returns.words.tolist() == ["F", "F", "S"]
    assert returns.image[:, 0] == pytest.approx([1.75, 2.25, 1.25])
    assert BoostConverter(alpha=4.0, I_ref=2.0).first_return([[2.5]]).words.tolist() == ["Z"]


class Circuit(HybridSystem):
    """The same with its events within a period: q is the clock."""

    alpha: float
    m_c: float
    I_ref: float
    rise: float
    states = ("i", "q")

    def modes(self, t, y):
        off = {"i": -self.alpha * self.rise, "q": 1}
        return {"on": {"i": self.rise, "q": 1}, "off": off, "empty": {"i": 0, "q": 1}}

    def guards(self, t, y):
        return {
            "S": Guard("on", self.I_ref - self.m_c * self.rise * y.q - y.i, to="off"),
            "Z": Guard("off", y.i, to="empty"),
            "C": Guard(("on", "off", "empty"), 1 - y.q, to="on", reset={"q": 0}),
        }

    def section(self, t, y):
        return PoincareSection("C", ("i",))


CIRCUITS = [
    ({"alpha": 2.5, "m_c": 0.3, "I_ref": 1.7, "rise": 0.7}, "NSZ"),
    ({"alpha": 0.8, "m_c": 0, "I_ref": 2, "rise": 1}, "NS"),
]


@pytest.mark.parametrize(("given", "letters"), CIRCUITS)
def test_it_is_the_circuit_from_clock_to_clock(given, letters):
    """Currents, derivatives and letters are those of a system with modes, whose events are S, Z and the clock C."""
    currents = np.linspace(0.011, given["I_ref"] - 0.013, 40)[:, None]
    return_map, circuit = (cls(**given).first_return(currents, derivative=True) for cls in (BoostConverter, Circuit))
    assert circuit.valid.all()
    assert return_map.image == pytest.approx(circuit.image, abs=1e-14)
    assert return_map.derivative == pytest.approx(circuit.derivative, abs=1e-12)
    last = [max(set(word) - {"C"}, default="N", key="SZ".index) for word in circuit.words.tolist()]
    assert return_map.words.tolist() == last
    assert set(last) == set(letters)


def test_check_system_finds_no_fault():
    check_system(BoostConverter(**CIRCUITS[0][0]), states=np.linspace(0.01, 4, 80)[:, None])


def test_the_cells_of_the_study_are_proved_to_be_forward_invariant():
    """The currents from I_ref - alpha to I_ref are carried into themselves: their cells, and images of those beside them."""
    pytest.importorskip("flint")
    made = prove_map(BoostConverter(alpha=2.5, I_ref=4), start=[3.3], box=[[0, 5]], n_cells=256)
    inside = np.flatnonzero(made.codes == 0)
    assert verify(made).closed.size == len(inside) < 2.5 / 5 * 256 + 8
    assert {*range(int(1.5 / 5 * 256) + 1, int(4 / 5 * 256))} <= set(inside.tolist())


@pytest.mark.thorough
def test_the_horseshoe_of_the_study_has_at_most_the_entropy_of_the_map():
    pytest.importorskip("flint")
    system = BoostConverter(alpha=2.5, I_ref=4)
    proved = verify(prove_horseshoe(system, [[1.5, 4]], 8, n_returns=4, depth=5))
    assert 0.2974 < proved.chaos.entropy < topological_entropy(system) < 0.5381
