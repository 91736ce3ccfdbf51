"""Certificates: traps and files, searched for, verified, refused where anything is changed; impacts against 60 digits."""

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from messages import message
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import ProofError

pytest.importorskip("flint")

from by_equation import Oscillator
from flint import arb, ctx
from motion import Equation, flight

from nsmaps.proof.cycles import certificate_of as cycles_of
from nsmaps.proof.formula import equation_of
from nsmaps.proof.horseshoe import prove_horseshoe
from nsmaps.proof.prove import prove
from nsmaps.proof.trap import _directions, found_trap, trapped
from nsmaps.verify.__main__ import main
from nsmaps.verify.cells import CertificateError
from nsmaps.verify.certificate import read, statement, verify, write_certificate
from nsmaps.verify.flights import next_impact
from nsmaps.verify.formula import UnprovedError, system_of
from nsmaps.verify.trap import contraction, trap_of

PAIR = {"d": 0.35, "r": 0.5, "g_bar": 0.2113275}
KEPT = Path(__file__).parents[2] / "docs" / "certificates"
SHAPES = {"side": 256, "depth": 0, "top": 1.0633, "max_periods": 2}


@pytest.fixture(scope="module")
def pair():
    return nsmaps.load_system("vi_pair", **PAIR)


@pytest.fixture(scope="module", autouse=True)
def coarse():
    """Traps of one size in fewer parts than by default."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nsmaps.proof.trap.SIZES", (0.08,))
        patch.setattr("nsmaps.proof.trap.SHAPES", ((0.6, (32, 8)),))
        yield


@pytest.fixture(scope="module")
def certificate(pair):
    return prove(pair, [0.8334, 0.3636], **SHAPES)


@pytest.fixture(scope="module")
def proved(certificate):
    return verify(certificate)


def test_a_share_of_the_states_is_proved_to_converge(pair, certificate, proved):
    """No random orbit from a certified cell ends elsewhere."""
    assert proved.shares[0] > 0.1
    assert proved.factor < 1
    side, codes = certificate.grid["side"], certificate.codes.reshape(2, 256, 256)[0]
    rng = np.random.default_rng(3)
    column, row = rng.choice(np.argwhere(codes < 65534), 4000, replace=False).T
    place = rng.uniform(size=(len(row), 2))
    states = np.column_stack([(row + place[:, 0]) * certificate.grid["top"] / side, (column + place[:, 1]) * 2 * np.pi / side])
    cycle = nsmaps.periodic_orbit(pair, [0.8334, 0.3636]).states[0]
    for _ in range(120):
        states = pair.first_return(states).image
    np.testing.assert_allclose(states, np.broadcast_to(cycle, states.shape), atol=1e-9)


def test_the_theorem_is_stated(certificate, proved):
    text = statement(proved, certificate)
    assert f"{np.floor(1e4 * proved.shares[0]) / 100:g} % of wall B" in text  # never more than is proved
    assert "left open" in text
    assert "g = 0.2113275 +/- " in text  # the numbers that were verified, not those that the file tells of itself
    assert "z = 0.175 +/- " in text


def changed(path: Path, out: Path, change) -> Path:
    """The file with its text changed."""
    with zipfile.ZipFile(path) as archive:
        text, codes = json.loads(archive.read("certificate.json")), archive.read("codes")
    text, codes = change(text, bytearray(codes))
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("certificate.json", json.dumps(text))
        archive.writestr("codes", bytes(codes))
    return out


def test_a_file_is_read_as_it_was_written(certificate, tmp_path):
    slopes = np.array([3, -5], np.int8)
    write_certificate(tmp_path / "a.proof", replace(certificate, slopes=slopes))
    found = read(tmp_path / "a.proof")
    np.testing.assert_array_equal(found.codes, certificate.codes)
    np.testing.assert_array_equal(found.slopes, slopes)
    assert (found.system, found.grid) == (certificate.system, certificate.grid)
    assert trap_of(found.trap) == trap_of(certificate.trap)


def test_files_without_strips_are_read(certificate, tmp_path):
    write_certificate(tmp_path / "a.proof", certificate)
    found = read(changed(tmp_path / "a.proof", tmp_path / "b.proof", lambda text, codes: ({**text, "format": 1}, codes)))
    np.testing.assert_array_equal(found.codes, certificate.codes)
    assert not len(found.slopes)


@pytest.mark.parametrize("wrong", ["bit of the codes", "bit of the file", "cut", "format", "missing", "none"])
def test_a_broken_file_is_refused(certificate, tmp_path, wrong):
    path = tmp_path / "a.proof"
    write_certificate(path, certificate)
    content = bytearray(path.read_bytes())
    match wrong:
        case "bit of the codes":
            changed(path, path, lambda text, codes: (text, codes[:40] + bytes([codes[40] ^ 1]) + codes[41:]))
        case "bit of the file":
            content[len(content) // 2] ^= 16
            path.write_bytes(content)
        case "cut":
            path.write_bytes(content[:-30])
        case "format":
            changed(path, path, lambda text, codes: ({**text, "format": 3}, codes))
        case "missing":
            changed(path, path, lambda text, codes: ({k: v for k, v in text.items() if k != "trap"}, codes))
        case "none":
            path.unlink()
    with pytest.raises(FileNotFoundError if wrong == "none" else CertificateError):
        read(path)


def test_any_changed_byte_is_one_line_or_nothing(tmp_path, capsys):
    """Another version or method in the zip's headers, lengths, times, text: the file is refused in a line, or is the same."""
    path, rng = tmp_path / "a.proof", np.random.default_rng(2)
    whole = read(KEPT / "chaos.proof")
    write_certificate(path, whole)
    content, reasons = path.read_bytes(), []
    assert content.count(b"PK\x01\x02") == 3  # the entries of the directory
    places = [4, 6, 8, 9, *(content.index(b"PK\x01\x02") + k for k in (4, 6, 7, 8, 10, 11)), *rng.integers(0, len(content), 250)]
    for place in places:
        path.write_bytes(content[:place] + bytes([content[place] ^ int(rng.integers(1, 256))]) + content[place + 1 :])
        try:
            found = read(path)
        except CertificateError as error:
            reasons.append(str(error))
        else:
            assert (found.system, found.horseshoe) == (whole.system, whole.horseshoe)
    assert len(reasons) > 150
    assert not any("\n" in reason for reason in reasons)
    place = content.index(b"PK\x01\x02") + 6  # the version that is needed to read it
    path.write_bytes(content[:place] + bytes([244]) + content[place + 1 :])
    assert main(str(path)) == 1
    assert "zip file version 24.4" in capsys.readouterr().out
    result = CliRunner().invoke(app, ["verify", str(path), "-q"])
    assert (result.exit_code, "zip file version 24.4" in result.output) == (1, True)


def test_parts_of_another_kind_are_refused_in_a_line(certificate, tmp_path):
    path, out = tmp_path / "a.proof", tmp_path / "b.proof"
    write_certificate(path, certificate)
    for part, value in (("about", []), ("system", 3), ("grid", None), ("cycles", {}), ("horseshoe", "x")):
        with pytest.raises(CertificateError, match=message("verify.another-kind")):
            read(changed(path, out, lambda text, codes, new={part: value}: (text | new, codes)))
    nested = f'{{"format": {"[" * 100_000}'
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("certificate.json", nested)
        archive.writestr("codes", b"")
    with pytest.raises(CertificateError, match=message("verify.not-whole")):
        read(out)


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("trap", {"half": (0.3, 0.3)}),
        ("trap", {"centre": (float("inf"), 0.8334)}),
        ("trap", {"impacts": True}),
        ("grid", {"side": 256.0}),
        ("grid", {"side": 2**20}),
        ("grid", {"closed": "no"}),
        ("grid", {"periods": 10**9}),
        ("grid", {"depth": 20}),
        ("system", {"walls": [None]}),
        ("trap", {"centre": (0.37, 0.8334)}),
        ("trap", {"wall": 1}),
        ("trap", {"impacts": 1}),
        ("trap", {"impacts": 0}),
        ("trap", {"matrix": ((1.0, 1.0), (1.0, 1.0))}),
        ("system", {"restitution": ["0.6", "0"]}),
        ("system", {"force": ["0.2", "0"]}),
        ("system", {"frequency": ["x", "0", 1]}),
        ("grid", {"top": 1.5}),
    ],
    ids=str,
)
def test_a_changed_statement_is_refused(certificate, part, change):
    with pytest.raises(CertificateError):
        verify(replace(certificate, **{part: {**getattr(certificate, part), **change}}))


def test_a_planted_error_of_the_search_is_found(pair, certificate, monkeypatch):
    """A trap that is three times as large as what was shown makes orders of cells that do not reach it."""
    wide = lambda trap, *boxes: trapped(trap._replace(half=(3 * trap.half[0], 3 * trap.half[1])), *boxes)  # noqa: E731
    monkeypatch.setattr("nsmaps.proof.prove.trapped", wide)
    monkeypatch.setattr("nsmaps.proof.prove.found_trap", lambda *given: trap_of(certificate.trap))
    with pytest.raises(CertificateError, match=message("verify.not-in-trap")):
        verify(prove(pair, [0.8334, 0.3636], **SHAPES))


def test_impacts_of_a_box_hold_those_of_its_states(pair):
    """The next impact in 60 digits, from the closed form of the pair, and its derivative by differences."""
    data = equation_of(pair)
    for name in ("force", "restitution"):
        data[name][1] = "0"
    for wall in data["walls"]:
        wall["at"][1] = "0"

    def follow(phase, speed):
        d, r, g = (mp.mpf(str(PAIR[name])) for name in ("d", "r", "g_bar"))

        def z(s):
            wave = (mp.cos(phase) - mp.cos(mp.pi * s + phase)) / mp.pi**2
            return d / 2 + (-r * speed - mp.sin(phase) / mp.pi) * s + g * s * s / 2 + wave

        s = mp.findroot(lambda s: z(s) + d / 2, (mp.mpf("0.9"), mp.mpf("1.3")), solver="anderson", tol=1e-110)
        return phase + mp.pi * s, -mp.diff(z, s)

    with mp.workdps(60), ctx.workprec(250):
        system = system_of(data)
        phase, speed, h = mp.mpf("0.3636"), mp.mpf("0.8334"), mp.mpf(10) ** -20
        thin = next_impact(system, 0, arb("0.3636"), arb("0.8334"))
        wide = next_impact(system, 0, arb("0.3636", "0.001"), arb("0.8334", "0.001"))
        exact = follow(phase, speed)
        for found, number in zip((thin.phase, thin.speed), exact, strict=True):
            assert found.overlaps(arb(mp.nstr(number, 60)) + arb(0, 1e-57))
            assert found.rad() < 1e-50
        assert thin.wall == wide.wall == 1
        assert wide.phase.contains(thin.phase)
        assert wide.speed.contains(thin.speed)
        for column, (by_phase, by_speed) in enumerate(((h, 0), (0, h))):
            ahead, behind = follow(phase + by_phase, speed + by_speed), follow(phase - by_phase, speed - by_speed)
            for row in (0, 1):
                slope = arb(mp.nstr((ahead[row] - behind[row]) / (2 * h), 40)) + arb(0, 1e-30)
                assert thin.derivative[row][column].overlaps(slope)
                assert wide.derivative[row][column].contains(thin.derivative[row][column])


@pytest.mark.parametrize(("name", "parameters", "start", "word"), [("bouncing_ball", {"Gamma": 1.2}, [4.19, 0.51], "BB")])
def test_traps_of_other_systems(name, parameters, start, word):
    system = nsmaps.load_system(name, **parameters)
    equation, orbit = equation_of(system), nsmaps.periodic_orbit(system, start)
    trap = found_trap(system_of(equation), [wall["letter"] for wall in equation["walls"]], orbit)
    assert orbit.word == word
    assert contraction(system_of(equation), trap) < 1


def test_a_trap_is_one_for_an_interval_of_a_parameter(pair):
    """For all lengths within 5e-4 the trap is contracted; with walls that are less certain it is not shown to be."""
    equation = equation_of(pair, {"d": 5e-4})
    trap = found_trap(
        system_of(equation), [wall["letter"] for wall in equation["walls"]], nsmaps.periodic_orbit(pair, [0.8334, 0.3636])
    )
    assert trap.half[0] == 0.08
    for d in (0.3495, 0.3505):
        at = nsmaps.periodic_orbit(nsmaps.load_system("vi_pair", **(PAIR | {"d": d})), [0.8334, 0.3636]).states[0]
        assert (abs(np.linalg.inv(trap.matrix) @ (at[::-1] - trap.centre)) < trap.half).all()
    walls = [{**wall, "at": [wall["at"][0], "0.003"]} for wall in equation["walls"]]
    with pytest.raises(UnprovedError):
        contraction(system_of({**equation, "walls": walls}), trap)


@pytest.mark.parametrize("gap", [0.0, 1e-9, 0.01, -0.01])
def test_directions_next_to_a_double_multiplier_are_not_parallel(gap):
    """Two real multipliers that have merged, nearly so, or just became complex: the sides of the trap stay apart."""
    matrix = _directions(np.array([[0.5, 1.0], [gap**2 * np.sign(gap), 0.5]]), 1.0)
    assert abs(np.linalg.det(matrix / np.linalg.norm(matrix, axis=0))) > 0.49


def test_systems_of_other_classes_are_refused(tmp_path):
    """By `prove` for cells and horseshoes, for cycles, and where a study is read, before anything is searched for."""
    modes = nsmaps.load_system("recoil_pair", eta=0.05, kappa=0.04, Lambda=0.2, d=0.35, g_bar=0.2113)
    integrated = Oscillator(zeta=0.1, w=0.8, A=1.0, wall=0.4, r=0.7)
    for system, kind in (
        (modes, message("proof.not-proved", system="RecoilPair")),
        (integrated, message("proof.integrated", system="Oscillator")),
        (lambda x: x, message("proof.not-a-system", given="function")),
    ):
        for search in (
            lambda system=system: prove(system, [0.5, 0, 0, 1], top=1.0),
            lambda system=system: cycles_of(system, []),
            lambda system=system: prove_horseshoe(system, [[0, 1]]),
        ):
            with pytest.raises(ProofError, match=kind):
                search()
    start = "{v: 0.5, X: 0, V: 0, phi: 1}"
    box = "{v: [0, 1], X: [0, 1], V: [0, 1], phi: [0, 1]}"
    for section in (f"proof: {{start: {start}, top: 1}}", f"horseshoe: {{box: {box}}}"):
        study = tmp_path / "modes.yaml"
        parameters = "{eta: 0.05, kappa: 0.04, Lambda: 0.2, d: 0.35, g_bar: 0.2113}"
        study.write_text(f"system: recoil_pair\nparameters: {parameters}\n{section}\n", encoding="utf-8")
        done = CliRunner().invoke(app, ["prove", str(study), "-q"])
        assert done.exit_code == 2
        assert "system with modes, and no proofs are made of such" in " ".join(done.output.split())


@pytest.mark.parametrize(
    ("radii", "said"),
    [
        ({"r": 0.01}, message("proof.not-of-walls", name="r")),
        ({"g_bar": 0.01}, message("proof.not-of-walls", name="g_bar")),
        ({"d": -1e-3}, message("proof.radius", name="d", radius=-0.001)),
        ({"length": 1e-3}, message("proof.radius", name="length", radius=0.001)),
    ],
)
def test_intervals_of_other_parameters_than_those_of_walls_are_refused(pair, radii, said):
    with pytest.raises(ProofError, match=said):
        equation_of(pair, radii)


def test_walls_that_may_touch_are_refused(pair):
    with pytest.raises(ProofError, match=message("verify.walls")):
        prove(pair, [0.83, 0.36], top=1.0, radii={"d": 0.36})


def test_a_displacement_that_does_not_solve_its_equation_is_refused():
    class Cubic(Oscillator.__base__):
        """Right at the start of each flight, wrong later."""

        def displacement(self, t, hit):
            return super().displacement(t, hit) + (t - hit.t) ** 3 / 100

    with pytest.raises(ProofError, match=message("proof.other-equation")):
        equation_of(Cubic(zeta=0.1, w=0.8, A=1.0, wall=0.4, r=0.7))


@pytest.mark.parametrize(("zeta", "regime"), [(1.0, "critical"), (1.5, "over")])
def test_cycles_of_oscillators_without_a_frequency_are_proved(zeta, regime):
    """Critical and over-damped motion: the cycle of one impact a period, from its closed form in 60 digits."""
    system = nsmaps.load_system("impact_oscillator", zeta=zeta, damping=regime, w=1.5, A=1.0, wall=0.1, r=0.3)
    made = cycles_of(system, [nsmaps.periodic_orbit(system, nsmaps.orbit(system, [0.3, 1.0], 60).states[-1])])
    cycle = verify(made).cycles[0]
    with mp.workdps(60):
        one = Equation(2 * mp.mpf(zeta), 1, 0, 1, 0, mp.mpf("1.5"), ((mp.mpf("0.1"), 1),), mp.mpf("0.3"))
        period = 2 * mp.pi / one.frequency

        def missed(phase, speed):
            z, v = flight(one, 0, phase, speed, period)
            return [z - one.walls[0][0], v - speed]

        exact = mp.findroot(missed, tuple(mp.mpf(float(x.mid())) for x in cycle.states[0]), tol=1e-90)
        assert all(x.overlaps(arb(mp.nstr(y, 40))) for x, y in zip(cycle.states[0], exact, strict=True))
    assert cycle.states[0][0].rad() < 1e-11
    assert (cycle.kind, cycle.turns) == ("stable", 1)


def test_bad_arguments_are_refused(pair):
    with pytest.raises(ProofError, match=message("proof.grid")):
        prove(pair, [0.83, 0.36], top=1.0, side=100)
    with pytest.raises(ProofError, match=message("proof.not-stable")):
        prove(pair, [0.34, 2.87], top=1.0)


def test_the_commands_write_and_verify(tmp_path, certificate, monkeypatch, capsys):
    monkeypatch.setattr("nsmaps.proof.prove.prove", lambda *given, **more: certificate)
    path = tmp_path / "fp.proof"
    done = CliRunner().invoke(app, ["prove", "vi_pair/proof-fp", "--out", str(path), "-q"])
    assert done.exit_code == 0
    assert "Proved: all orbits" in done.output
    assert main(str(path)) == 0
    assert "Proved: all orbits" in capsys.readouterr().out
    write_certificate(path, replace(certificate, trap={**certificate.trap, "impacts": 0}))
    refused = CliRunner().invoke(app, ["verify", str(path), "-q"])
    assert refused.exit_code == 1
    assert "refused" in refused.output
    assert main(str(path)) == 1
    monkeypatch.setattr("nsmaps.proof.prove.prove", pytest.fail)
    nowhere = CliRunner().invoke(app, ["prove", "vi_pair/proof-fp", "--out", str(path / "fp.proof"), "-q"])
    assert (nowhere.exit_code, str(path) in nowhere.output.replace("\n", "")) == (2, True)
    other = CliRunner().invoke(app, ["prove", "vi_pair/fp"])
    assert other.exit_code == 2
    assert "section 'proof'" in other.output


def test_cells_of_which_nothing_is_proved_are_a_failed_claim(tmp_path):
    """Cells larger than the trap: none of them lies in it."""
    study = tmp_path / "coarse.yaml"
    proof = "{start: {v: 4.19, phi: 0.51}, top: 6, side: 32, depth: 0, max_periods: 2}"
    study.write_text(f"system: bouncing_ball\nparameters: {{Gamma: 1.2, r: 0.5}}\nproof: {proof}\n")
    path = str(tmp_path / "coarse.proof")
    for words in (["prove", str(study), "--out", path, "-q"], ["verify", path, "-q"]):
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 1
        assert (
            "Not proved: where orbits from any cell come to; all cells of impact speeds below 6.0 are left open." in done.output
        )
        assert "converge" not in done.output
    assert main(path) == 1
