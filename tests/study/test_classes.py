"""Studies with regions, fits and families of user-defined classes: run, stored, resumed, copied; errors at their place."""

import pickle
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.errors import NsmapsError, StudyError
from nsmaps.plugins import FAMILY, FIT, REGION, class_of, system_class
from nsmaps.study.reading.shipped import copy_study

CLASSES = """
import numpy as np
import sympy as sp
import nsmaps


class Disc(nsmaps.Region):
    centre: tuple[float, float]
    radius: float

    def contains(self, states):
        x = np.asarray(states, float)
        return ((x - self.centre) ** 2).sum(axis=1) <= self.radius**2

    def condition(self):
        v, phi = (sp.Symbol(str(name), real=True) for name in self.coordinates)
        return (v - self.centre[0]) ** 2 + (phi - self.centre[1]) ** 2 <= self.radius**2


class Even(nsmaps.PolyFit):
    degree: int = 2

    def exponents(self, coordinates, output):
        return np.array([[k, j] for k in range(self.degree + 1) for j in range(3)])

    def data(self, surface, output):
        return np.ones(len(surface.start), bool)


class Odd(Even):
    def exponents(self, coordinates, output):
        return np.array([[0, coordinates.index("w")]])


class Slow(nsmaps.ReturnFamily):
    speed: float = 0.2

    def contains(self, returns):
        return returns.valid & (returns.start[:, 0] <= self.speed)


class Lost(nsmaps.ReturnFamily):
    def contains(self, returns):
        return returns.start[:, 5] > 0


class Square(Disc):
    def contains(self, states):
        return np.abs(np.asarray(states) - self.centre).max(axis=1) <= self.radius


class Crooked(Disc):
    width: float = 1.0

    def model_post_init(self, context):
        self.width.nothing
"""
STUDY = """\
system: ball
parameters: {a: 0.2, r: 1/2}
grid:
  v: {from: 0.01, to: 0.5, points: 41}
  phi: {from: 0, to: 2*pi, points: 41}
families:
  slow: {class: "mine.py:Slow", speed: 3/10}
composite:
  - name: disc
    region: {class: "mine.py:Disc", centre: [1/5, pi/2], radius: 0.35}
    family: slow
    fit: {class: "mine.py:Even", absolute: [v]}
  - name: other
    where: 0 < 1
    family: slow
    fit: {full: {v: 2, phi: 2}}
    data: {class: "mine.py:Disc", centre: [0.2, 2], radius: 1}
diagonal:
  family: slow
  delta: 3
  region: {class: "mine.py:Disc", centre: [0.2, 2], radius: 3}
  orders: {even: {class: "mine.py:Even", degree: 1}, full: {full: {v: 1, phi: 2}}}
orbits:
  - {start: {v: 0.2, phi: 1.5}, n_returns: 3}
figures: [words, surfaces, regions]
"""


def install(site: Path, package: str, points: dict[str, str], sources: dict[str, str]) -> None:
    """A package on the path with entry points, by group."""
    info = site / f"{package}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("\n".join(f"[{group}]\n{point}" for group, point in points.items()))
    for name, text in sources.items():
        (site / name).parent.mkdir(parents=True, exist_ok=True)
        (site / name).write_text(text)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a study and the file of its classes."""
    (tmp_path / "mine.py").write_text(CLASSES)
    (tmp_path / "own.yaml").write_text(STUDY)
    return tmp_path


def test_a_study_of_classes_is_run(folder: Path) -> None:
    result = nsmaps.run_study(folder / "own.yaml")
    surface = result.surfaces["slow"]
    assert len(surface.start)
    assert (surface.start[:, 0] <= 0.3).all()
    disc, other = result.composite.pieces
    inside = ((surface.start - [0.2, np.pi / 2]) ** 2).sum(axis=1) <= 0.35**2
    assert disc.map.report.points.tolist() == [inside.sum()] * 2
    assert disc.map.absolute == ("v",)
    assert other.map.report.points.tolist() == [(((surface.start - [0.2, 2]) ** 2).sum(axis=1) <= 1).sum()] * 2
    assert [name for name, _ in result.orders] == ["even", "full"]
    assert result.family("slow").speed == 0.3


def test_a_study_of_classes_is_stored_and_resumed(folder: Path) -> None:
    study, out = nsmaps.load_study(folder / "own.yaml"), folder / "run"
    result = nsmaps.run_study(study, out=out)
    read = nsmaps.read_result(out)
    assert read.study == study
    assert read.family("slow") == result.family("slow")
    states = np.random.default_rng(1).uniform([0, 0], [0.5, 6], (200, 2))
    assert (read.composite.piece_of(states) == result.composite.piece_of(states)).all()
    assert np.unique(read.composite.piece_of(states)).tolist() == [0, 1]
    assert type(read.composite.pieces[0].region) is nsmaps.ConditionRegion  # the condition, for which nothing is executed
    again = nsmaps.run_study(study, out=out, resume=True)
    assert again.timings == result.timings
    (folder / "own.yaml").write_text(STUDY.replace("speed: 3/10", "speed: 0.29"))
    with pytest.raises(NsmapsError, match=message("study.other-run", what="study")):
        nsmaps.run_study(folder / "own.yaml", out=out, resume=True)
    with pytest.raises(
        StudyError,
        match=message("study.executed", kind="class", what="file", path=re.compile(r".*mine\.py:Slow"), at="own.yaml:7:17"),
    ):
        nsmaps.load_study(folder / "own.yaml", installed_only=True)


@pytest.mark.parametrize(
    ("old", "new", "place", "said"),
    [
        (
            'Disc", centre: [1/5',
            'Disk", centre: [1/5',
            '"mine.py:Disk',
            message("errors.no-such-near", kind="class", name="Disk", near="Disc"),
        ),
        (
            'mine.py:Even", abs',
            'mine.py:Disc", abs',
            '"mine.py:Disc", abs',
            message("plugins.not-a-kind", kind="fit", base="nsmaps.PolyFit"),
        ),
        (
            "radius: 0.35",
            "radus: 0.15",
            "radus",
            message("errors.unknown-near", kind="field of Disc", name="radus", near="radius", known="centre, radius"),
        ),
        ("radius: 0.35", "radius: wide", "wide", message("errors.unknown", kind="name", name="wide", known="numbers")),
        ("radius: 0.35", "radius: [1]", "[1]", message("errors.value", name="radius", value="[1]", expected="a number")),
        (", radius: 0.35", "", '{class: "mine.py:Disc", centre: [1/5', message("study.key-lacks", name="radius")),
        (
            'mine.py:Even", degree',
            'mine.py:Odd", degree',
            '{class: "mine.py:Odd',
            message("testing.class-raises", what="Odd.exponents", error="ValueError"),
        ),
        (
            "speed: 3/10",
            "sped: 3/10",
            "sped",
            message("errors.unknown-near", kind="field of Slow", name="sped", near="speed", known="max_returns, speed"),
        ),
        (
            "mine.py:Slow",
            "nsmaps:ReturnFamily",
            '"nsmaps:Ret',
            message("plugins.class-lacks", cls="nsmaps:ReturnFamily", missing="contains"),
        ),
        (
            "mine.py:Slow",
            "slow",
            '"slow"',
            message("plugins.not-installed", kind="family", name="slow", known="none; or a class in a file"),
        ),
        (
            "mine.py:Slow",
            "nowhere.else:Slow",
            '"nowhere',
            message("plugins.file-not-imported", file="nowhere.else", error="ModuleNotFoundError: No module"),
        ),
        (
            'mine.py:Disc", centre: [1',
            'mine.py:Square", centre: [1',
            '{class: "mine.py:Square',
            message("testing.two-sets", cls="Square"),
        ),
        (
            'mine.py:Disc", centre: [1/5, pi/2], radius: 0.35',
            'mine.py:Crooked", centre: [1, 1], radius: 1',
            '{class: "mine.py:Crooked',
            message("testing.class-raises", what="Crooked", error="AttributeError"),
        ),
    ],
)
def test_errors_of_classes_are_at_their_place(folder: Path, old: str, new: str, place: str, said: str) -> None:
    text = STUDY.replace(old, new, 1)
    assert text != STUDY
    (folder / "own.yaml").write_text(text)
    with pytest.raises(StudyError) as caught:
        nsmaps.load_study(folder / "own.yaml")
    at = text.index(place)
    line, column = text[:at].count("\n") + 1, at - text[:at].rfind("\n")
    assert str(caught.value).startswith(f"{folder / 'own.yaml'}:{line}:{column}: "), caught.value
    assert re.search(said, str(caught.value))


def test_an_error_of_a_family_is_at_its_place(folder: Path) -> None:
    (folder / "own.yaml").write_text(STUDY.replace('"mine.py:Slow", speed: 3/10', '"mine.py:Lost"'))
    where = message(
        "study.returned-alone",
        method="Lost.contains",
        place=re.compile(r".*mine\.py:\d+"),
        number=1681,
        error="IndexError: index 5 is out of bounds",
        at="own.yaml:7:9",
    )
    with pytest.raises(StudyError, match=where):
        nsmaps.run_study(folder / "own.yaml")


LOZI = """
import nsmaps


class Lozi(nsmaps.PiecewiseMap):
    a: float = 0.6
    b: float = 0.3
    coordinates = ("x", "y")

    def pieces(self, x):
        return {
            "L": (x.x < 0, {"x": 1 + self.a * x.x + x.y, "y": self.b * x.x}),
            "R": (True, {"x": 1 - self.a * x.x + x.y, "y": self.b * x.x}),
        }


class Right(nsmaps.ReturnFamily):
    edge: float = 0.0

    def contains(self, returns):
        return returns.start[:, 0] >= self.edge
"""
PARTITION = """\
system: lozi.py:Lozi
grid: {x: {from: -1.0, to: 1.5, points: 21}, y: {from: -0.5, to: 0.5, points: 21}}
families: {right: {class: "lozi.py:Right", edge: 0.3}}
partition:
  tolerance: 1e-6
  families: [right]
  regions: [y > 0.2]
  orders: {zero: {full: {}}, one: {class: "mine.py:Even", degree: 1}}
  attracting: [{x: [0.5, 1.2], y: [-0.1, 0.4]}]
"""


@pytest.mark.thorough
def test_a_partition_of_a_study_takes_classes(folder: Path) -> None:
    """The pieces are affine, each on one side of the given region and of the family's edge."""
    (folder / "lozi.py").write_text(LOZI)
    (folder / "own.yaml").write_text(PARTITION)
    result = nsmaps.run_study(folder / "own.yaml", out=folder / "run")
    assert result.partition.met
    assert {row.order for row in result.partition.table()} <= {"zero", "one", "constant"}
    states = np.random.default_rng(1).uniform([-1, -0.5], [1.5, 0.5], (20_000, 2))
    number, beyond = result.composite.piece_of(states), states[:, 1] > 0.2
    assert not set(number[beyond]) & set(number[~beyond])
    read = nsmaps.read_result(folder / "run")
    assert read.study.partition == result.study.partition
    assert read.partition.spec == nsmaps.Partition(tolerance=1e-6)
    assert (read.composite.piece_of(states) == number).all()
    for old, new, said in (
        (
            "[right]",
            "[rihgt]",
            message("errors.unknown-near", kind="family", name="rihgt", near="right", known="right", at="own.yaml:6:14"),
        ),
        ("x: [0.5, 1.2], ", "", message("study.coordinate-missing", name="x", at="own.yaml:9:16")),
        (
            "degree: 1",
            "degree: wide",
            message("errors.value", name="degree", value="'wide'", expected="an integer", at="own.yaml:8:67"),
        ),
        (
            "tolerance",
            "kind: accurate\n  tolerance",
            message("study.of-closed-forms", names="'attracting', 'families', 'orders', 'regions'", at="own.yaml:5:3"),
        ),
    ):
        (folder / "own.yaml").write_text(PARTITION.replace(old, new, 1))
        with pytest.raises(StudyError, match=said):
            nsmaps.load_study(folder / "own.yaml")


def test_installed_classes_and_classes_of_modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    site = tmp_path / "site"
    points = {"regions": "disc = own_classes:Disc", "fits": "even = own_classes:Even", "families": "slow = own_classes:Slow"}
    install(site, "own_classes", {f"nsmaps.{group}": each for group, each in points.items()}, {"own_classes.py": CLASSES})
    monkeypatch.syspath_prepend(str(site))
    assert class_of(REGION, "disc") is class_of(REGION, "own_classes:Disc")
    assert class_of(FIT, "even").__name__ == "Even"
    text = STUDY.replace("mine.py:Disc", "disc").replace("mine.py:Even", "even")
    (tmp_path / "own.yaml").write_text(text.replace("mine.py:Slow", "slow"))
    result = nsmaps.run_study(nsmaps.load_study(tmp_path / "own.yaml", installed_only=True))
    assert {result.versions[name] for name in ("disc", "even", "slow")} == {"own_classes 1.0"}
    assert type(result.family("slow")) is class_of(FAMILY, "own_classes:Slow")
    (tmp_path / "own.yaml").write_text(
        text.replace("mine.py:Slow", "slow").replace('"even", degree: 1', '"nsmaps:Fourier", harmonics: 1')
    )
    fit = nsmaps.load_study(tmp_path / "own.yaml", installed_only=True).diagonal.orders["even"]
    assert class_of(FIT, fit.of) is nsmaps.Fourier
    (tmp_path / "own.yaml").write_text(text.replace("mine.py:Slow", "own_classes:Slow"))
    assert nsmaps.load_study(tmp_path / "own.yaml").families["slow"].of == "own_classes:Slow"
    with pytest.raises(StudyError, match=message("study.executed", kind="class", what="module", path="own_classes:Slow")):
        nsmaps.load_study(tmp_path / "own.yaml", installed_only=True)


def test_objects_of_classes_in_files_reach_other_processes(folder: Path) -> None:
    disc = class_of(REGION, f"{folder}/mine.py:Disc")(coordinates=("x", "y"), centre=(0.1, 0.2), radius=0.3)
    sent = [pickle.dumps(each) for each in (disc, class_of(FIT, f"{folder}/mine.py:Even")(degree=4))]
    del sys.modules[type(disc).__module__]  # as where nothing has loaded the file
    region, fit = map(pickle.loads, sent)
    assert type(region) is not type(disc)
    assert (region.centre, region.coordinates, fit.degree) == ((0.1, 0.2), disc.coordinates, 4)


def test_a_shipped_study_is_copied_with_the_files_of_its_classes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    site = tmp_path / "site"
    text = STUDY.replace("system: ball", "system: own_shipped")
    module = f"from {system_class('ball').__module__} import Ball"
    sources = {"own_shipped/__init__.py": module, "own_shipped/studies/own.yaml": text, "own_shipped/studies/mine.py": CLASSES}
    install(site, "own_shipped", {"nsmaps.systems": "own_shipped = own_shipped:Ball"}, sources)
    monkeypatch.syspath_prepend(str(site))
    (tmp_path / "to").mkdir()
    written = copy_study("own_shipped/own", tmp_path / "to")
    assert sorted(path.name for path in written) == ["mine.py", "own.yaml"]
    assert nsmaps.load_study(tmp_path / "to" / "own.yaml").composite[0].region.of == f"{tmp_path}/to/mine.py:Disc"
