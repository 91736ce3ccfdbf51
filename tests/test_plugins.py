"""Installed systems: found by name without an import, and one that is broken harms no other."""

import importlib
import pickle
import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from messages import message

from nsmaps import plugins
from nsmaps.errors import NsmapsError, SystemDefinitionError, UnknownSystemError

SYSTEM = """
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall

class {name}(ImpactSystem):
    \"\"\"A ball.\"\"\"
    a: float = 1.0
    r: float = 0.5

    def walls(self):
        return {{"B": Wall(at=0, side=-1)}}

    def period(self):
        return 1

    def displacement(self, t, hit):
        return hit.w * (t - hit.t)
"""


def install(folder: Path, package: str, points: dict[str, str], text: str) -> None:
    """A package of one module, `package`, and its metadata, in a folder on the path."""
    info = folder / f"{package}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    lines = "\n".join(f"{name} = {value}" for name, value in points.items())
    (info / "entry_points.txt").write_text(f"[nsmaps.systems]\n{lines}\n")
    (folder / package / "studies").mkdir(parents=True)
    (folder / package / "__init__.py").write_text(text)
    (folder / package / "studies" / "rest.yaml").write_text(f"system: {next(iter(points))}\n")


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path with one good package."""
    folder = tmp_path / "site"
    install(folder, "one_good", {"t_good": "one_good:Good"}, SYSTEM.format(name="Good"))
    monkeypatch.syspath_prepend(str(folder))
    return folder


def test_a_study_is_of_the_system_that_it_names(site: Path) -> None:
    install(site, "one_pair", {"t_pair": "one_pair:A", "t_pair_2": "one_pair:B"}, "raise RuntimeError('imported')")
    (site / "one_pair" / "studies" / "second.yaml").write_text("title: two\nsystem: 't_pair_2'\n")
    assert [list(plugins.study_files(name)) for name in ("t_pair", "t_pair_2")] == [["rest"], ["second"]]
    assert {"t_pair/rest", "t_pair_2/second"} == {name for name in plugins.study_names() if name.startswith("t_pair")}


def test_names_and_studies_are_found_without_an_import(site: Path) -> None:
    install(site, "one_loud", {"t_loud": "one_loud.deep.down:Loud"}, "raise RuntimeError('imported')")
    assert {"t_good", "t_loud"} <= set(plugins.system_names())
    assert plugins.study_files("t_loud") == {"rest": site / "one_loud" / "studies" / "rest.yaml"}
    assert {"t_good/rest", "t_loud/rest"} <= set(plugins.study_names())
    assert "one_loud" not in sys.modules


def test_a_broken_plugin_is_named_and_harms_no_other(site: Path) -> None:
    install(site, "one_broken", {"t_broken": "one_broken:Broken"}, "import no_such_module")
    install(site, "one_other", {"t_other": "one_other:thing"}, "def thing(): pass")
    with pytest.warns(UserWarning, match=message("plugins.not-imported")) as told:
        found = plugins.systems()
    assert found["t_good"].__name__ == "Good"
    assert not {"t_broken", "t_other"} & set(found)
    texts = [str(warning.message) for warning in told]
    reason = "ModuleNotFoundError: No module named 'no_such_module'"
    assert f"plugin 't_broken' of one_broken 1.0 failed to import: {reason}" in texts
    assert any(text.startswith("plugin 't_other' of one_other 1.0") and "ImpactSystem" in text for text in texts)
    with pytest.raises(SystemDefinitionError, match=message("plugins.not-imported", name="t_broken", owner="one_broken 1.0")):
        plugins.load_system("t_broken")


def test_good_plugins_give_no_warning(site: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert plugins.system_class("t_good").__name__ == "Good"


def test_two_packages_of_one_name_are_both_named(site: Path) -> None:
    install(site, "one_rival", {"t_good": "one_rival:Good", "t_fine": "one_rival:Good"}, SYSTEM.format(name="Good"))
    for ask in (plugins.systems, lambda: plugins.load_system("t_good"), lambda: plugins.study_files("t_good")):
        with pytest.raises(
            SystemDefinitionError, match=message("plugins.two-owners", name="t_good", owner="one_good 1.0", other="one_rival 1.0")
        ):
            ask()
    assert "t_good" in plugins.system_names()
    assert plugins.load_system("t_fine").parameters == {"a": 1.0, "r": 0.5}
    assert "t_good/rest" not in plugins.study_names()


def test_a_sketch_is_found_by_the_name_of_its_system(site: Path) -> None:
    text = SYSTEM.format(name="Drawn") + "\ndef sketch(ax):\n    return ax, 'drawn'\n"
    install(site, "one_drawn", {"t_drawn": "one_drawn:Drawn"}, text)
    points = site / "one_drawn-1.0.dist-info" / "entry_points.txt"
    points.write_text(points.read_text() + "[nsmaps.sketches]\nt_drawn = one_drawn:sketch\nt_gone = one_drawn:gone\n")
    assert plugins.sketch_of("t_drawn")("axes") == ("axes", "drawn")  # type: ignore[arg-type, comparison-overlap]
    with pytest.raises(NsmapsError, match=message("plugins.no-sketch", system="t_good", known=re.compile(".*t_drawn"))):
        plugins.sketch_of("t_good")
    with pytest.raises(
        SystemDefinitionError, match=message("plugins.not-imported", name="t_gone", owner="one_drawn 1.0", error="AttributeError")
    ):
        plugins.sketch_of("t_gone")
    install(site, "one_too", {"t_too": "one_too:Good"}, SYSTEM.format(name="Good"))
    (site / "one_too-1.0.dist-info" / "entry_points.txt").write_text("[nsmaps.sketches]\nt_drawn = one_too:Good\n")
    with pytest.raises(
        SystemDefinitionError, match=message("plugins.two-sketches", name="t_drawn", owner="one_drawn 1.0", other="one_too 1.0")
    ):
        plugins.sketch_of("t_drawn")


def test_an_unknown_name_lists_what_is_installed(site: Path) -> None:
    with pytest.raises(
        UnknownSystemError,
        match=message("plugins.not-installed-near", kind="system", name="t_god", near="t_good", known=re.compile(".*t_good")),
    ):
        plugins.load_system("t_god")


def test_a_system_is_validated(site: Path) -> None:
    assert plugins.load_system("t_good", a=2).parameters["a"] == 2
    with pytest.raises(ValueError, match=message("errors.unknown", kind="parameter")):
        plugins.load_system("t_good", b=2)


def test_a_file_serves_as_a_plugin(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(SYSTEM.format(name="Mine"))
    system = plugins.load_system(f"{file}:Mine", a=3)
    cls = type(system)
    assert system.parameters["a"] == 3
    assert importlib.import_module(cls.__module__).Mine is cls
    assert plugins.system_class(f"{file}:Mine") is cls
    assert type(pickle.loads(pickle.dumps(system))) is cls
    file.write_text(SYSTEM.format(name="Mine") + "\n# edited")
    assert plugins.system_class(f"{file}:Mine") is not cls


def test_errors_about_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    with pytest.raises(UnknownSystemError, match=message("plugins.no-file", file=re.compile(r".*mine\.py"), name="Mine")):
        plugins.load_system(f"{file}:Mine")
    file.write_text(SYSTEM.format(name="Mine"))
    with pytest.raises(UnknownSystemError, match=message("errors.no-such-near", kind="class", name="Mien", near="Mine")):
        plugins.load_system(f"{file}:Mien")
    file.write_text("1 / 0")
    before = set(sys.modules)
    with pytest.raises(
        SystemDefinitionError,
        match=message("plugins.file-not-imported", file=re.compile(r".*mine\.py"), error="ZeroDivisionError: division by zero"),
    ):
        plugins.load_system(f"{file}:Mine")
    assert set(sys.modules) == before


def test_a_bad_class_of_a_file_keeps_no_good_one_from_being_used(tmp_path: Path) -> None:
    """Not here, nor in a process that is sent a good one, nor what inherits from the bad one and mends it.

    The bad one is refused by its name and line, and what inherits its formula by its own, with where the formula is.
    """
    file = tmp_path / "two.py"
    bad = SYSTEM.format(name="Bad").replace("return hit.w", "return hit.z + self.walls + hit.w")
    heirs = SYSTEM.format(name="Mended").replace("(ImpactSystem)", "(Bad)") + "\n\nclass Heir(Bad):\n    b: float = 1\n\n"
    file.write_text(f"import sympy\n{bad}{heirs}{SYSTEM.format(name='Good')}")
    good = plugins.load_system(f"{file}:Good", a=2)
    assert good.parameters == plugins.load_system(f"{file}:Mended", a=2).parameters == {"a": 2, "r": 0.5}
    code = f"import pickle; print(pickle.loads({pickle.dumps(good)!r}).parameters['a'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={"PYTHONPATH": ":".join(sys.path)})
    assert done.stdout == "2.0\n", done.stderr
    lines = file.read_text().split("\n")
    for name, base in (("Bad", "ImpactSystem"), ("Heir", "Bad")):
        line = lines.index(f"class {name}({base}):") + 1
        said, ends = (
            message("plugins.not-a-system", file=file, name=name),
            message("exact.class", cls=name, place=f"{file}:{line}"),
        )
        with pytest.raises(SystemDefinitionError, match=f"{said}.*{ends}"):
            plugins.load_system(f"{file}:{name}")
    said = message("exact.inherited", cls="Heir", formula="displacement", base="Bad", file=file)
    with pytest.raises(SystemDefinitionError, match=said):
        plugins.load_system(f"{file}:Heir")


def test_the_projects_own_plugins_are_registered_as_a_strangers_would_be() -> None:
    lines = (Path(__file__).parents[1] / "pyproject.toml").read_text()
    assert '[project.entry-points."nsmaps.systems"]\nvi_pair = "nsmaps_vi_pair:VIPair"' in lines
    assert 'bouncing_ball = "nsmaps_bouncing_ball:BouncingBall"\nimpact_oscillator = "nsmaps_impact_oscillator:' in lines
    check = "import sys, nsmaps.plugins as p; p.system_names(); p.study_names(); "
    check += "assert not [m for m in sys.modules if m.startswith('nsmaps_')]"
    subprocess.run([sys.executable, "-c", check], check=True)
