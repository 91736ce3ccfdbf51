"""The plugin border_collision: reference values M1, M2, M3, M6, M7, in exact arithmetic or by long runs of another program."""

import pickle
from itertools import pairwise

import numpy as np
import pytest
from messages import message
from nsmaps_border_collision import BorderCollision, BorderCollision1, BorderCollision3, Lozi, UnitTent, normal_form
from piecewise_references import check_cycles, check_exponents, cyclic, number, numbers, rows, word_of

import nsmaps
from nsmaps.dynamics.search import periodic_orbits_by_word
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.piecewise.affine import affine_pieces
from nsmaps.symbolic.kneading import topological_entropy

PLANE, TENT, GAP, SPACE, LORENZ = (rows(name) for name in ("M1", "M2", "M3", "M6", "M7"))
FORMS = {"M1": (BorderCollision, PLANE, 6), "M6": (BorderCollision3, SPACE, 5)}
CASES = [(name, case) for name, (_, table, _) in FORMS.items() for case in table["cases"]]
BORDERS = [(name, border) for name, (_, table, _) in FORMS.items() for border in table["borders"]]


TITLES = [f"{name} {one['word']} {one['parameter']} {one['value']:.6}" for name, one in BORDERS]


def lorenz(parameters):
    """The map of two slopes, in the class of the plugin."""
    of = numbers(parameters)
    return BorderCollision1(a_L=of["aL"], a_R=of["aR"], mu=of["cL"], jump=-of["cL"] - of["cR"])


def tent(parameters):
    of = numbers(parameters)
    return BorderCollision1(a_L=of["aL"], a_R=of["aR"], mu=of["mu"])


@pytest.mark.parametrize(("name", "case"), CASES, ids=lambda part: part if isinstance(part, str) else part["key"])
def test_all_cycles_and_the_exponents_of_normal_forms(name, case):
    cls, _, period = FORMS[name]
    system = cls(**numbers(case["parameters"]))
    check_cycles(system, case["orbits"], period)
    if "lyapunov" in case:
        check_exponents(system, case["lyapunov"])
    if "sum" in case:
        assert nsmaps.lyapunov(
            system, starts=np.full(len(system.coordinates), 0.1), n_returns=1000
        ).exponents.sum() == pytest.approx(number(case["sum"]), abs=1e-12)
    for each in case.get("attractor_exponents", []):
        exponents = [number(text) for text in each["exponents"]]
        orbit = next(orbit for orbit in periodic_orbits_by_word(system, period) if cyclic(orbit.word) == cyclic(each["word"]))
        assert np.log(np.abs(orbit.multipliers)) / orbit.period == pytest.approx(exponents, abs=1e-12)
        assert nsmaps.lyapunov(system, starts=orbit.states[0], n_returns=10_000).exponents == pytest.approx(exponents, abs=1e-3)


def cycle_at(system, word):
    """The cycle of a word, None where there is none."""
    return next((each for each in periodic_orbits_by_word(system, len(word)) if cyclic(each.word) == cyclic(word)), None)


@pytest.mark.parametrize(("name", "border"), BORDERS, ids=TITLES)
def test_on_which_side_of_a_border_a_cycle_is_there_and_stable(name, border):
    """Beside the value, at a share of 1e-11 of it, and of 1e-8 where the orbit becomes infinite."""
    value, others = number(border["value"]), numbers(border["other_parameters"])
    share = 1e-8 if border["kind"].endswith("+1") else 1e-11
    for side, way in (("below", -1), ("above", 1)):
        system = FORMS[name][0](**others, **{border["parameter"]: value + way * share * abs(value)})
        orbit = cycle_at(system, border["word"])
        assert (orbit is not None) == border[f"admissible_{side}"]
        assert orbit is None or orbit.stable == border[f"stable_{side}"]


EVENTS = {"multiplier +1": "cycle at infinity", "multiplier -1": "period doubling"}
LONGER = {"LLR": pytest.mark.thorough}  #: branches to a cycle at infinity have many orbits


@pytest.mark.parametrize(
    ("name", "border"),
    [
        pytest.param(name, one, marks=LONGER.get(one["word"], ()) if one["kind"].endswith("+1") else (), id=title)
        for (name, one), title in zip(BORDERS, TITLES, strict=True)
    ],
)
def test_the_branch_of_a_cycle_has_an_event_at_the_border(name, border):
    """To 1e-14 of the value, from a hundredth of it beside it on the side on which the cycle is there."""
    value, parameter = number(border["value"]), border["parameter"]
    way = -1 if border["admissible_below"] else 1
    system = FORMS[name][0](**numbers(border["other_parameters"]), **{parameter: value * (1 + way * 0.01 * np.sign(value))})
    bounds = sorted(value * (1 + 0.02 * np.array([-1, 1])))
    orbit = cycle_at(system, border["word"])
    branch = nsmaps.continue_branch(
        system, parameter, orbit, getattr(system, parameter), bounds, direction="down" if way > 0 else "up"
    )
    (event,) = branch.events
    right = affine_pieces(system.at(**{parameter: value}))[0][1]
    doubles = border["word"] == "LR" and abs(np.linalg.det(np.eye(len(right)) + right)) < 1e-12  # R does, in a segment
    assert event.kind == EVENTS.get(border["kind"], "period halving" if doubles else "border collision")
    assert event.value == pytest.approx(value, rel=1e-14)
    assert abs(event.value - value) <= 2 * event.precision
    assert event.precision < 1e-12


@pytest.mark.parametrize("case", TENT["full"], ids=lambda case: case["parameters"]["a"])
def test_the_tent_of_the_unit_interval(case):
    system = UnitTent(**numbers(case["parameters"]))
    check_cycles(system, case["orbits"], max(len(each["word"]) for each in case["orbits"]))
    found = nsmaps.lyapunov(system, starts=[0.1234567], n_returns=500_000)
    assert abs(found.exponents[0] - number(case["lyapunov_exact"])) <= 5 * found.error[0]
    assert topological_entropy(system) == pytest.approx(np.log(2), abs=1e-14)


@pytest.mark.parametrize("case", TENT["border_form"], ids=lambda case: case["parameters"]["aR"])
def test_the_tent_in_border_form(case):
    system = tent(case["parameters"])
    check_cycles(system, case["orbits"], max(len(each["word"]) for each in case["orbits"]))
    if "lyapunov" in case:
        check_exponents(system, case["lyapunov"])


@pytest.mark.parametrize("row", TENT["borders"], ids=lambda row: f"{row['aL']} {row['word']}")
def test_the_windows_of_the_tent(row):
    """The cycle L^(n-1) R exists below one slope and is stable above the other, exact to 1e-12 of them."""
    exists, stable = number(row["exists_below"]), number(row["stable_above"])
    at = {value: cycle_at(BorderCollision1(a_L=number(row["aL"]), a_R=value), row["word"]) for value in beside(exists, stable)}
    assert [orbit is not None for orbit in at.values()] == [value < exists for value in at]
    assert all(orbit is None or orbit.stable == (value > stable) for value, orbit in at.items())
    assert any(orbit is not None and orbit.stable for orbit in at.values()) == row["window"]


@pytest.mark.parametrize("row", TENT["borders"], ids=lambda row: f"{row['aL']} {row['word']}")
def test_the_events_of_a_cycle_of_tents(row):
    """Its branch ends at the border collision, and has a degenerate doubling on the way there if it is stable.

    That of LR ends where R doubles, at the slope -1, with the other end of a segment of cycles.
    """
    exists, stable = number(row["exists_below"]), number(row["stable_above"])
    start = 1.5 * min(exists, stable)
    system = BorderCollision1(a_L=number(row["aL"]), a_R=start)
    branch = nsmaps.continue_branch(system, "a_R", cycle_at(system, row["word"]), start, (2 * start, 0), direction="up")
    end = "period halving" if row["word"] == "LR" else "border collision"
    kinds = ["period doubling", end] if row["window"] else [end]
    values = [stable, exists] if row["window"] else [exists]
    assert [event.kind for event in branch.events] == kinds
    assert [event.value for event in branch.events] == pytest.approx(values, rel=1e-13)


def beside(*values):
    return [value + way * 1e-12 * abs(value) for value in values for way in (-1, 1)]


@pytest.mark.parametrize("case", GAP, ids=lambda case: case["a"])
def test_all_windows_of_the_map_with_a_gap(case):
    """Inside, 1e-12 from both ends, orbits have the word, and 1e-12 beyond them another one."""
    a, windows = number(case["a"]), case["windows"]
    system = BorderCollision1(a_L=a, a_R=a, jump=-1)
    ends = np.array([[number(low), number(high)] for _, low, high, _ in windows])
    inside = np.column_stack([ends[:, 0] + 1e-12, ends.mean(axis=1), ends[:, 1] - 1e-12])
    values = np.concatenate([inside, ends + np.array([-1e-12, 1e-12])], axis=1)
    found = nsmaps.bifurcation_diagram(system, "mu", values.ravel(), [0.1], n_returns=600, transient=600)
    words = found.words[:, 0].reshape(len(windows), 5, 600)
    for (rotation, _, _, word), letters in zip(windows, words, strict=True):
        p, q = map(int, rotation.split("/"))
        assert (word.count("R"), len(word)) == (p, q)
        for k, many in enumerate(letters):
            repeats = cyclic(word_of(many[:q])) == cyclic(word) and np.array_equal(many[q:], many[:-q])
            assert repeats == (k < 3), (rotation, k)
    exponent = nsmaps.lyapunov(system.at(mu=0.4), starts=[0.1], n_returns=1000).exponents[0]
    assert exponent == pytest.approx(number(case["exponent"]), abs=1e-13)


@pytest.mark.parametrize("case", LORENZ["two_slopes"], ids=lambda case: case["parameters"]["aL"])
def test_lorenz_maps_of_two_slopes(case):
    system = lorenz(case["parameters"])
    check_cycles(system, case["orbits"], 7)
    check_exponents(system, case["lyapunov"])
    assert topological_entropy(system) == pytest.approx(number(case["topological_entropy"]), abs=1e-14)
    for start, kneading in ((-1e-300, case["minus"]), (0.0, case["plus"])):
        assert word_of(nsmaps.orbit(system, [start], len(kneading)).words) == kneading


@pytest.mark.parametrize("row", LORENZ["constant_slope"], ids=lambda row: row["parameters"]["beta"])
def test_lorenz_maps_of_constant_slope(row):
    """beta x + alpha mod 1, about its jump: the slope on either side, and a jump of -1."""
    beta, alpha = (number(row["parameters"][name]) for name in ("beta", "alpha"))
    system = BorderCollision1(a_L=beta, a_R=beta, mu=1 - (1 - alpha) / beta, jump=-1)
    assert topological_entropy(system) == pytest.approx(number(row["topological_entropy"]), abs=1e-14)
    assert nsmaps.lyapunov(system, starts=[0.1], n_returns=1000).exponents[0] == pytest.approx(number(row["lyapunov"]), abs=1e-13)


def test_the_lozi_map_is_a_normal_form():
    """With traces a and -a and determinants -b."""
    form = BorderCollision(tau_L=1.7, delta_L=-0.5, tau_R=-1.7, delta_R=-0.5)
    assert same_pieces(form, Lozi(a=1.7, b=0.5))


def same_pieces(one, other):
    """Whether the matrices and vectors of all pieces are equal."""
    return one.letters == other.letters and all(map(np.array_equal, affine_pieces(one), affine_pieces(other)))


@pytest.mark.parametrize(
    "system",
    [BorderCollision1(a_L=0.4, a_R=-1.5, mu=0.7)]
    + [cls(**numbers(table["cases"][0]["parameters"])) for cls, table, _ in FORMS.values()],
    ids=lambda system: type(system).__name__,
)
def test_normal_forms_of_any_dimension(system):
    """Coefficients of characteristic polynomials: -tau, and delta or sigma, -delta, or minus the slope."""
    n, of = len(system.coordinates), system.parameters
    names = {1: ["a"], 2: ["tau", "delta"], 3: ["tau", "sigma", "delta"]}[n]
    values = {f"d{k + 1}_{side}": (-1) ** (k + 1) * of[f"{name}_{side}"] for k, name in enumerate(names) for side in "LR"}
    assert same_pieces(system, normal_form(n)(**values, mu=of["mu"]))


def test_a_normal_form_of_five_dimensions():
    """Multipliers are the zeros of the polynomials; it is sent to other processes by its name."""
    sides = {"L": [0.9, -0.4, 0.3, -0.1, 0.2], "R": [1.2, 0.3, -0.2, 0.1, 0.05]}
    form = normal_form(5)(**{f"d{k + 1}_{side}": value for side in sides for k, value in enumerate(sides[side])}, mu=0.5)
    matrices, vectors = affine_pieces(form)
    for matrix, side in zip(matrices, sides.values(), strict=True):
        assert np.poly(matrix) == pytest.approx([1, *side], abs=1e-14)
    assert vectors.tolist() == [[0.5, 0, 0, 0, 0]] * 2
    assert pickle.loads(pickle.dumps(form)) == form
    with pytest.raises(SystemDefinitionError, match=message("plugins.dimensions", number=0)):
        normal_form(0)


def test_orbits_that_diverge_slowly_escape():
    """Beyond the fixed point L, at -1/(a_L - 1) for mu = 1, they grow by a_L a return: after 1,500 returns they are finite."""
    system, values = BorderCollision1(a_L=1.15, a_R=-10.0), [-8.0, -7.0, -4.0]
    assert (1 + np.array(values) < -1 / 0.15).tolist() == [True, False, False]
    found = nsmaps.bifurcation_diagram(system, "a_R", values, [0.1], transient=1000)
    assert found.labels[:, 0].tolist() == ["escapes", "C", "C"]
    plane = nsmaps.parameter_plane(system, {"a_R": values, "mu": [0.5, 1.0]}, [0.1], n_returns=500, transient=1000)
    assert [plane.labels[0, k, 0] for k in range(3)] == ["escapes", "C", "C"]


@pytest.mark.thorough
def test_the_study_of_period_adding_has_windows_in_closed_form(shipped):
    """L^(n-1) R and its mirror image from (1 - a)/(1 - a^n) times a^(n-1) to a^(n-2)."""
    found = {
        window.label: window
        for window in nsmaps.read_result(shipped("border_collision_1/adding")).bifurcation_diagram["exact"].windows
    }
    a = 0.7
    for n in (2, 3, 4, 5, 6):
        window = found[f"{'L' * (n - 1)}R, period {n}"]
        ends = np.array([a ** (n - 1), a ** (n - 2)]) * (1 - a) / (1 - a**n)
        assert [window.low.value, window.high.value] == pytest.approx(ends, abs=1e-14)
        assert window.low.kind == window.high.kind == "border collision"
        mirrored = found[f"L{'R' * (n - 1)}, period {n}"]
        assert [mirrored.low.value, mirrored.high.value] == pytest.approx(1 - ends[::-1], abs=1e-14)


@pytest.mark.thorough
def test_the_study_of_basins_has_polygons(shipped):
    """The middle of an edge of the manifold is between the basins: a little to either side of it orbits end differently."""
    result = nsmaps.read_result(shipped("border_collision/basins"))
    assert {attractor.label for attractor in result.basins.attractors} == {"R, period 1", "LLR, period 3"}
    (stable,) = result.manifolds["LRR"]
    checked = 0
    for line in stable.lines:
        for one, other in pairwise(line):
            middle, across = (one + other) / 2, np.array([one[1] - other[1], other[0] - one[0]])
            if not (np.abs(middle) < 3).all() or np.abs(other - one).max() < 0.05:
                continue
            sides = nsmaps.orbit(result.system, middle + 1e-6 * np.array([[1.0], [-1.0]]) * across, 3000).words[-3:]
            assert {"".join(sorted(words)) for words in sides.T.tolist()} == {"LLR", "RRR"}
            checked += 1
    assert checked > 20
