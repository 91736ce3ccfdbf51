"""The page on notation: every name on it exists, and the numbers of its blocks are those of 30 digits and by hand."""

import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import get_args

import mpmath as mp
import numpy as np
import pytest
from pydantic import BaseModel, RootModel
from ruamel.yaml import YAML
from test_docs import FENCE

import nsmaps
from nsmaps.study.sections.maps.fits import FitSection
from nsmaps.study.study import CATALOGUE, Study

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "reference" / "notation.md").read_text(encoding="utf-8")
COLUMNS = ["in the paper", "Python", "study", "figure", "differs"]
LABELS = {entry["label"] for entry in YAML(typ="safe").load((ROOT / "docs" / "gallery" / "figures.yaml").read_text())["figures"]}


def rows() -> list[dict[str, str]]:
    """The rows of the tables of symbols and terms, by column."""
    found, columns = [], []
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line[1:-1].split("|")] if line.startswith("|") else []
        if len(cells) == len(COLUMNS):
            columns = cells if cells == COLUMNS else columns
            found += [dict(zip(columns, cells, strict=True))] if columns and cells != columns and "---" not in line else []
    return found


def resolved(name: str) -> object:
    """What a dotted name stands for, from `nsmaps`, a room of it or a module; AttributeError if there is nothing."""
    parts = name.split(".")
    rooms = [nsmaps, *(getattr(nsmaps, room) for room in dir(nsmaps) if room not in nsmaps.__all__)]
    if holders := [room for room in rooms if hasattr(room, parts[0])]:
        thing: object = holders[0]
    else:
        count = next(k for k in range(len(parts), 0, -1) if _is_module(".".join(parts[:k])))
        thing, parts = import_module(".".join(parts[:count])), parts[count:]
    for part in parts:
        fields = getattr(thing, "model_fields", {}) | getattr(thing, "__dataclass_fields__", {})
        thing = fields[part] if part in fields else getattr(thing, part)
    return thing


def _is_module(name: str) -> bool:
    try:
        import_module(name)
    except ModuleNotFoundError:
        return False
    return True


def keys_of(model: type[BaseModel]) -> dict[str, list[type[BaseModel]]]:
    """The keys of a section with the models of what stands there."""
    keys = {field.alias or name: field.annotation for name, field in model.model_fields.items()}
    return {name: [each for found in sections(of) for each in entries(found)] for name, of in keys.items()}


def sections(annotation: object) -> Iterator[type[BaseModel]]:
    """The models within an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from sections(part)


def entries(model: type[BaseModel]) -> list[type[BaseModel]]:
    """The models of the entries of a section that is a list or a mapping; of another that section's."""
    return list(sections(model.model_fields["root"].annotation)) if issubclass(model, RootModel) else [model]


def test_every_row_names_something_here():
    assert len(rows()) > 40
    for row in rows():
        assert any("`" in row[column] for column in ("Python", "study", "figure")), row["in the paper"]


@pytest.mark.parametrize("row", rows(), ids=lambda row: row["in the paper"][:30])
def test_the_names_of_a_row_exist(row):
    for name in re.findall(r"`([^`]+)`", row["Python"]):
        resolved(name)
    top = keys_of(Study) | {"fit": [FitSection]}
    for key in re.findall(r"`([^`]+)`", row["study"]):
        section, _, inner = key.partition(": ")
        assert section in top, key
        assert not inner or any(inner in keys_of(model) for model in top[section]), key
    for figure in re.findall(r"`([^`]+)`", row["figure"]):
        assert figure in CATALOGUE, figure


def test_a_name_that_is_not_there_is_seen():
    for name in ("Piece.regions", "nsmaps.auxiliary.envelope.Envelope.above", "Nothing"):
        with pytest.raises((AttributeError, StopIteration, ImportError)):
            resolved(name)


def test_figures_and_studies_in_the_text_exist():
    assert set(re.findall(r"fig\. `([^`]+)`", PAGE)) <= LABELS
    for name in set(re.findall(r"`((?:vi_pair|soft_impact)/[\w-]+)`", PAGE)):
        nsmaps.load_study(name)
    for name in ("two_masses", "recoil_pair"):
        assert name in nsmaps.systems()


TERMS = (
    *(r"\dot Z", r"\psi", "F_1", "F_2", "P_{BTB}", "P_{BB}", "P_{BTTB}", "P_{BBTB}", r"\partial B", r"\partial T", r"\bar g"),
    *(
        "building block",
        "f_n",
        "g_n",
        r"\mathcal M$",
        r"\mathcal M_{\mathcal A}^{(N)}",
        r"\mathcal A^{(N)}",
        r"\mathcal B^{(N+1)}",
    ),
    *(
        "WCS",
        "generic",
        "Statement, part 1 and 2",
        "p, q",
        "separable",
        "reset",
        "filter",
        r"\xi",
        r"\eta",
        r"\zeta",
        r"\alpha_i",
    ),
)


def test_the_terms_of_the_paper_are_on_the_page():
    assert [term for term in TERMS if term not in PAGE] == []


def files() -> dict[str, str]:
    """The classes of the page, by the file that a reader would write."""
    found = [match[2] for match in FENCE.finditer(PAGE) if match[1] == "python" and match[2].startswith("# file: ")]
    return {re.match(r"# file: (\S+)\n", text)[1]: text for text in found}


@pytest.fixture
def written(tmp_path, monkeypatch):
    for name, text in files().items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def by_hand(v, phi, a, d):
    """The first return to B under the two tones, from eq. relvar in 30 digits: word, speed, phase."""
    r, g = mp.mpf("0.5"), mp.mpf("0.1245") * mp.mpf("9.8") * mp.sin(mp.pi / 3) / 5
    rate = lambda t: (mp.sin(mp.pi * t) + a * mp.sin(3 * mp.pi * t) / 3) / (mp.pi * (1 + a))  # noqa: E731
    place = lambda t: -(mp.cos(mp.pi * t) + a * mp.cos(3 * mp.pi * t) / 9) / (mp.pi**2 * (1 + a))  # noqa: E731
    t0, z0, w, word = mp.mpf(float(phi)) / mp.pi, d / 2, -r * mp.mpf(float(v)), "B"
    step = mp.mpf(1) / 200
    while True:
        flight = lambda t: z0 + w * (t - t0) + g * (t - t0) ** 2 / 2 + place(t) - place(t0) - rate(t0) * (t - t0)  # noqa: B023, E731
        t = t0 + step
        while abs(flight(t)) < d / 2:
            t += step
        side = mp.sign(flight(t))
        t = mp.findroot(lambda x: flight(x) - side * d / 2, (t - step, t), solver="anderson", tol=1e-50)  # noqa: B023
        speed = w + g * (t - t0) + rate(t) - rate(t0)
        word += "B" if side > 0 else "T"
        if side > 0:
            return word, speed, (mp.pi * t) % (2 * mp.pi)
        t0, z0, w = t, side * d / 2, -r * speed


@pytest.mark.parametrize("d", [0.35, 0.26])
def test_the_map_under_another_force_is_that_of_flights_in_30_digits(written, d):
    system = nsmaps.load_system("two_tone.py:TwoTone", d=d, a=0.2, M=0.1245, g=9.8, beta=np.pi / 3, F=5)
    starts = np.random.default_rng(5).uniform((0.3, 0.2), (1.0, 3.0), (12, 2))
    returns = system.first_return(starts)
    with mp.workdps(30):
        for start, image, word in zip(starts, returns.image, returns.words, strict=True):
            expected, speed, phase = by_hand(*start, mp.mpf(0.2), mp.mpf(d))
            assert word == expected
            assert image == pytest.approx([float(speed), float(phase)], abs=1e-12)


def test_the_two_cycle_of_the_page_is_one_of_flights_in_30_digits():
    (shown,) = re.findall(r"states\[-2:\]\.round\(8\)\.tolist\(\)\n\[\[(.+?)\], \[(.+?)\]\]", PAGE)
    first, second = ([float(number) for number in state.split(", ")] for state in shown)
    with mp.workdps(30):
        for start, end in ((first, second), (second, first)):
            word, *image = by_hand(*start, mp.mpf("0.2"), mp.mpf("0.35"))
            assert word == "BTB"
            assert [float(number) for number in image] == pytest.approx(end, abs=5e-8)


def test_the_device_in_si_units_is_the_pair_scaled(written):
    """Lengths by F pi^2/(M omega^2), speeds by F pi/(M omega), times by pi/omega; at parameters of which none is one."""
    F, M, omega, s, beta = 3.7, 0.21, 11.0, 0.4, 0.8
    device = nsmaps.load_system("device.py:Device", s=s, F=F, M=M, omega=omega, beta=beta, r=0.6)
    pair = nsmaps.load_system("vi_pair", s=s, F=F, M=M, omega=omega, beta=beta, g=9.8, r=0.6)
    starts = np.random.default_rng(6).uniform((0.1, 0.0), (1.0, 6.2), (200, 2))
    unit = F * np.pi / (M * omega)
    found, expected = device.first_return(starts * [unit, 1]), pair.first_return(starts)
    assert found.words.tolist() == expected.words.tolist()
    assert found.image / [unit, 1] == pytest.approx(expected.image, abs=1e-10)
    assert found.time * omega / np.pi == pytest.approx(expected.time, abs=1e-10)


def test_the_energy_of_the_device_is_that_of_its_impacts_by_hand(written):
    """The loss of kinetic energy at both impacts of 1:1 motion, from the speeds of a flight in eq. relvar with scipy's root."""
    from scipy.optimize import brentq

    device = nsmaps.load_system("device.py:Device", s=0.35 * 5 / (0.1245 * 25))
    v, phase = nsmaps.orbit(device, [6.7, 0.36], 400).final
    A, omega, fall, t0 = 5 / (0.1245 * (5 * np.pi) ** 2), 5 * np.pi, 9.8 * np.sin(np.pi / 3), phase / (5 * np.pi)
    speed = lambda t: -v / 2 + fall * (t - t0) + A * omega * (np.sin(omega * t) - np.sin(omega * t0))  # noqa: E731
    gap = lambda t: (  # noqa: E731
        2 * 0.562248995983936 / 2
        - v / 2 * (t - t0)
        + fall * (t - t0) ** 2 / 2
        - A * (np.cos(omega * t) - np.cos(omega * t0))
        - A * omega * np.sin(omega * t0) * (t - t0)
    )
    times = t0 + np.linspace(1e-4, 0.4, 4000)
    first = int(np.argmax(gap(times) < 0))
    at_T = abs(speed(brentq(gap, times[first - 1], times[first], xtol=1e-15)))
    by_impacts = 0.0035 * 0.75 * (v**2 + at_T**2) / 2
    energy = {"name": "energy", "formula": "(v**2 - v_after**2)/2", "scale": 0.0035, "unit": "J"}
    found = nsmaps.observe(device, [v, phase], [energy], n_returns=50).per_period.value[0]
    assert found == pytest.approx(by_impacts, rel=1e-9)
    assert found == pytest.approx(0.0845755, rel=1e-6), "as on the page"
