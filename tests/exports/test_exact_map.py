"""The exact first return as a program: C is compiled and run, Julia run where it is, and as Python everywhere."""

import re
import shutil
import subprocess
from types import SimpleNamespace

import as_python
import numpy as np
import pytest
import sympy as sp
import systems
from messages import message
from run_c import Program, compare_node

import nsmaps
import nsmaps.plugins
from nsmaps.errors import NsmapsError
from nsmaps.exact.flows.formulas import V
from nsmaps.exact.words import encode
from nsmaps.exports.languages import LANGUAGES
from nsmaps.exports.programs.laws import law_texts

gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not here, so the C was not run")
pytestmark = gcc


def states_of(speed, n, slow=0.2):
    """States over all phases, a share of them slow."""
    rng = np.random.default_rng(7)
    v = rng.uniform(0, speed, n)
    v[: int(slow * n)] *= 10.0 ** rng.uniform(-12, 0, int(slow * n))
    return np.column_stack([v, rng.uniform(-7, 7, n)])


SYSTEMS = {
    "vi_pair": (lambda: nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113), 1.3, 20_000, {"returned"}),
    "bouncing_ball": (lambda: nsmaps.load_system("bouncing_ball", Gamma=1.3, r=0.4), 3.0, 20_000, {"returned", "stuck"}),
    "impact_oscillator": (
        lambda: nsmaps.load_system("impact_oscillator", zeta=0.02, w=0.9, A=0.4, wall=-0.3),
        2.0,
        20_000,
        {"returned", "stuck"},
    ),
    "no lift": (lambda: nsmaps.load_system("bouncing_ball", Gamma=0.6, r=0.4), 3.0, 5000, {"returned", "rests"}),
    "no wall met": (lambda: nsmaps.load_system("impact_oscillator", zeta=0.02, w=0.9, A=0.1, wall=2.0), 3.0, 300, {"escaped"}),
    "curved law": (lambda: systems.DraggedBall(a=0.7), 3.0, 20_000, {"returned"}),
    "two walls": (lambda: systems.Oscillator(zeta=0.1, w=2.2, gap=0.1), 3.0, 20_000, {"returned"}),
    "equal rates": (lambda: systems.Oscillator(zeta=1, w=2.2, gap=0.1, damping="critical"), 3.0, 20_000, {"undecided"}),
    "growing": (lambda: systems.Saddle(k=3.0), 3.0, 20_000, {"returned"}),
}


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The library of a system by its name, compiled once."""
    known = {}

    def of(name):
        if name not in known:
            known[name] = Program(SYSTEMS[name][0](), tmp_path_factory.mktemp("exact"))
        return known[name]

    return of


@pytest.mark.parametrize("name", SYSTEMS)
def test_c_is_the_compiled_map(name, library):
    """Every image to the last two bits, every outcome and every word."""
    make, speed, n, expected = SYSTEMS[name]
    states = np.concatenate([states_of(speed, n), [[-1, 0], [np.nan, 0], [1, 1e11], [0, 0], [0, 4], [1e-310, 2]]])
    images, outcomes, codes = library(name).batch(states)
    own = make().first_return(states)
    assert outcomes.tolist() == own.outcome.tolist()
    assert codes.tolist() == own.codes.tolist()
    np.testing.assert_allclose(images, own.image, rtol=4e-16, atol=0)
    assert expected <= {library(name).outcome(each) for each in set(outcomes)}
    for code in set(codes.tolist()):
        assert library(name).word(code) == own.words[codes.tolist().index(code)]


@pytest.mark.parametrize("chatter", [0.0, np.inf])
def test_c_sums_chatter_where_it_is_asked_to_and_gives_derivatives(chatter, library):
    system = SYSTEMS["bouncing_ball"][0]()
    states = states_of(0.5, 300)
    own = system.first_return(states, derivative=True, chatter=chatter)
    assert ("B~" in own.words) == (chatter > 0)
    for k, state in enumerate(states):
        got = library("bouncing_ball").of(state, chatter)
        assert [got.outcome, got.code, got.turns] == [own.outcome[k], own.codes[k], own.turns[k, 1]]
        np.testing.assert_allclose([*got.image, got.time], [*own.image[k], own.time[k]], rtol=4e-16)
        np.testing.assert_allclose(got.derivative, own.derivative[k].ravel(), rtol=4e-16)


def test_c_against_50_digits(pair, reference, tmp_path):
    """Grazing and slow states of the references, one program for each d: no digits but those of the compiled map are lost."""
    rows = [row for row in reference("hard_returns") + reference("first_returns") if row["r"] == 0.5 and row["beta"] == "pi/3"]
    for d in (0.26, 0.35):
        own = [row for row in rows if row["d"] == d]
        states = np.array([[row["v"], row["phi"]] for row in own])
        images, _, codes = Program(pair(d), tmp_path, f"pair{round(100 * d)}").batch(states)
        assert codes.tolist() == [encode(row["word"], ("B", "T")) for row in own]
        error = np.abs(images - [[float(row["v1"]), float(row["phi1"])] for row in own])
        assert np.median(error) < 1e-15
        assert {row["kind"] for row in own if "kind" in row} >= {"graze"}
        near = np.array([abs(row["eps"]) if "eps" in row else 1.0 for row in own])
        assert (error.max(axis=1) < 1e-13 / np.sqrt(near)).all()


@pytest.mark.parametrize("name", ["vi_pair", "bouncing_ball", "curved law", "equal rates", "growing"])
def test_julia_as_python(name):
    """The text of the module by rules of its own, not by those that wrote it: the same images, outcomes and words."""
    make, speed, _, _ = SYSTEMS[name]
    system, states = make(), states_of(speed, 60, 0.5)
    names = as_python.run(nsmaps.export(system, "julia", name="exact"))
    own = system.first_return(states)
    got = [names["first_return"](names["flow"](0), *state, 1e-12, False) for state in states.tolist()]
    assert [each[0] for each in got] == own.outcome.tolist()
    assert [each[5] for each in got] == own.codes.tolist()
    np.testing.assert_allclose([each[1:3] for each in got], own.image, rtol=4e-16)


node = pytest.mark.skipif(not shutil.which("node"), reason="node is not here, so the JavaScript was not run")


@node
@pytest.mark.parametrize("name", ["vi_pair", "curved law"])
def test_javascript(name, tmp_path):
    """Bit by bit, as these programs call no function whose last digit is the library's."""
    make, speed, _, _ = SYSTEMS[name]
    np.testing.assert_array_equal(*compare_node(make(), states_of(speed, 2000), tmp_path))


@pytest.mark.skipif(not shutil.which("julia"), reason="julia is not here, so the Julia was run as Python only")
def test_julia(tmp_path):
    system, states = SYSTEMS["vi_pair"][0](), states_of(1.3, 1000)
    nsmaps.export(system, "julia", tmp_path, name="exact")
    states.tofile(tmp_path / "states.bin")
    program = (
        'include("exact.jl"); x = reshape(reinterpret(Float64, read("states.bin")), 2, :);'
        "for k in axes(x, 2) r = Exact.exact(x[:, k]; derivative=true);"
        'println(join([r.image; vec(r.derivative\')], " "), " ", Exact.word(r.code)) end'
    )
    told = subprocess.run(["julia", "-e", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    rows = [line.split() for line in told.stdout.splitlines()]
    own = system.first_return(states, derivative=True)
    assert [row[-1] for row in rows] == own.words.tolist()
    numbers = np.array([[float(x) for x in row[:-1]] for row in rows])
    np.testing.assert_allclose(numbers[:, :2], own.image, rtol=1e-14)
    np.testing.assert_allclose(numbers[:, 2:], own.derivative.reshape(-1, 4), rtol=1e-10)


@pytest.mark.parametrize("name", ["vi_pair", "duffing", "neuron"])
def test_a_language_that_is_refused_leads_to_those_that_are_not(name):
    cls, refused = nsmaps.plugins.system_class(name), {}
    needed = [key for key, field in cls.model_fields.items() if field.is_required()]
    system = SYSTEMS[name][0]() if name in SYSTEMS else cls(**dict.fromkeys(needed, 0.5))
    for language in LANGUAGES:
        try:
            nsmaps.export(system, language)
        except NsmapsError as error:
            refused[language] = str(error).partition("; expected: ")[2]
    written = [language for language in LANGUAGES if language not in refused]
    assert set(refused.values()) == {", ".join(written) or "a `displacement`"}


@pytest.mark.parametrize("language", ["c", "julia"])
def test_a_name_that_the_program_has_already_is_refused(language):
    with pytest.raises(NsmapsError, match=message("exports.name-twice", name="flow")):
        nsmaps.export(SYSTEMS["vi_pair"][0](), language, name="flow")


def test_a_program_may_have_the_name_of_a_function_of_the_engine(tmp_path):
    name, (make, speed, *_) = "first_impact", SYSTEMS["vi_pair"]
    program, states = Program(make(), tmp_path, name, "-O0"), states_of(speed, 100)
    assert re.search(rf"\b{name}_2\b", (tmp_path / f"{name}.c").read_text())  # the engine's, with a number
    own, (images, _, codes) = make().first_return(states), program.batch(states)
    assert codes.tolist() == own.codes.tolist()
    np.testing.assert_allclose(images, own.image, rtol=4e-16, atol=0)
    assert f"function {name}(state;" in nsmaps.export(make(), "julia", name=name)


def test_a_law_that_c_has_no_function_for_is_refused():
    formulas = SimpleNamespace(symbols=(), laws=[sp.besselj(0, V)] * 2)
    kernel = SimpleNamespace(table=np.zeros(40), formulas=formulas, system=SYSTEMS["curved law"][0]())
    with pytest.raises(NsmapsError, match=message("exports.law", law="besselj(0, v)", system="DraggedBall")):
        law_texts(kernel, "p->table", 0)


def test_a_header_says_how_it_is_called():
    text = nsmaps.export(SYSTEMS["vi_pair"][0](), "c")["vipair.h"]
    assert re.search(r"The exact first return of VIPair at d = 0\.35, r = 0\.5, g_bar = 0\.2113\.", text)
    assert "0 returned, 1 stuck, 2 rests, 3 escaped, 4 undecided, 6 invalid, 8 endless" in text
