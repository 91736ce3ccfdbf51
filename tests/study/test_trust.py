"""Studies, run folders and exported files of strangers: each is answered by a line before anything is computed or written."""

import inspect
import json
import re
import shutil
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from messages import message
from stored import write_study
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import NsmapsError, StudyError
from nsmaps.study.limits import sizes, total
from nsmaps.study.store.archive import resolved
from nsmaps.study.study import Study

STORED = Path(__file__).parents[1] / "data" / "run-format-4"
MARK = "from pathlib import Path\nPath('mark').write_text('was run')\n"  #: what a stranger's file does when it is run


def refused(*command: str) -> str:
    """The one line with which a command refuses, nothing of it on standard output and nothing written."""
    before = sorted(path for path in Path().rglob("*"))
    answer = CliRunner().invoke(app, list(command))
    assert (answer.exit_code, answer.stdout) == (2, ""), answer.output
    assert answer.stderr.count("\n") == 1, answer.stderr
    assert sorted(path for path in Path().rglob("*")) == before
    return answer.stderr.strip()


@pytest.fixture
def stranger() -> None:
    """A study whose system is a file that leaves a mark where it is run."""
    from nsmaps.plugins import system_class

    source = inspect.getsource(sys.modules[system_class("ball").__module__])
    Path("mine.py").write_text(MARK + source)
    Path("s.yaml").write_text("# mine\nsystem: mine.py:Ball\nparameters: {a: 1}\n")


def test_check_says_that_a_file_is_run_before_it_is(stranger: None, monkeypatch: pytest.MonkeyPatch) -> None:
    import nsmaps.plugins

    said: list[str] = []
    monkeypatch.setattr("typer.echo", lambda text="", **how: said.append(str(text)))
    run_file = nsmaps.plugins.run_file
    monkeypatch.setattr(nsmaps.plugins, "run_file", lambda *file: (said.append("RUN"), run_file(*file)))
    assert CliRunner().invoke(app, ["check", "s.yaml"]).exit_code == 0
    mine = Path("mine.py").resolve()
    first = f"executes {mine}:Ball, the file of the system, with your permissions; --installed-only refuses it"
    assert said[:2] == [first, "RUN"]
    assert Path("mark").exists()


def test_a_file_is_not_run_with_installed_only(stranger: None) -> None:
    path = Path("mine.py").resolve()
    line = f"s.yaml:2:9: the system is the file '{path}:Ball', which would be executed; expected: an installed system, "
    for command in ("check", "run"):
        assert refused(command, "s.yaml", "--installed-only").startswith(line)
    for call in (nsmaps.load_study, nsmaps.run_study):
        with pytest.raises(StudyError, match=message("study.executed")):
            call("s.yaml", installed_only=True)
    assert not Path("mark").exists()
    study = nsmaps.load_study("s.yaml")
    with pytest.raises(StudyError, match=message("study.executed")):
        nsmaps.run_study(study, installed_only=True)


@pytest.mark.parametrize(
    "command", [("figures",), ("animate", "--", "cobweb"), ("report",), ("export", "--to", "c"), ("cite",)], ids=lambda c: c[0]
)
def test_nor_is_the_file_of_a_run_folder(command: tuple[str, ...], stranger: None) -> None:
    name, *options = command
    shutil.copytree(STORED / "run", "out")
    text = Path("out/study.yaml").read_text()
    write_study("out", text.replace("system: vi_pair", f"system: {Path('mine.py').resolve()}:Ball"))
    positional = [option for option in options if option == "cobweb"]
    rest = [option for option in options if option not in ("--", "cobweb")]
    assert "which would be executed" in refused(name, "out", *positional, *rest, "--installed-only")
    with pytest.raises(StudyError, match=message("study.executed")):
        nsmaps.read_result("out", installed_only=True)
    assert not Path("mark").exists()


def test_a_run_that_goes_on_runs_no_file_that_its_study_does_not_name(stranger: None) -> None:
    shutil.copytree(STORED / "run", "out")
    Path("mine.yaml").write_text(resolved(nsmaps.read_result("out").study))
    text = Path("out/study.yaml").read_text()
    write_study("out", text.replace("system: vi_pair", f"system: {Path('mine.py').resolve()}:Ball"))
    with pytest.raises(NsmapsError, match=message("study.executed")):
        nsmaps.run_study("mine.yaml", out="out", resume=True)
    assert not Path("mark").exists()


def test_installed_systems_are_accepted_with_installed_only() -> None:
    assert nsmaps.load_study("ball/drop", installed_only=True).system == "ball"
    assert nsmaps.read_result(STORED / "run", installed_only=True).finished
    assert json.loads((STORED / "run" / "result.json").read_text())["system"]["name"] == "vi_pair"


LAUGHS = "".join(f"k{n}: &k{n} [{', '.join([f'*k{n - 1}'] * 9) if n else 'ha'}]\n" for n in range(9))

# what a study of a stranger says, and what it is answered
HOSTILE = {
    "aliases of aliases": (LAUGHS + "system: ball\n", "s.yaml:6:40: more than 100,000 values, with aliases expanded"),
    "an alias of itself": ("system: ball\nfamilies: &a {x: *a}\n", "s.yaml:2:18: the alias *a is inside its own anchor"),
    "deep": ("system: ball\nrequire: " + "[" * 5000, "s.yaml:2:49: nested deeper than 40 levels"),
    "deep in blocks": ("".join(" " * k + "a:\n" for k in range(500)), "s.yaml:41:41: nested deeper than 40 levels"),
    "large": ("# " + "x" * 500_000 + "\nsystem: ball\n", "s.yaml:1:1: a file of 500,016 bytes; expected: at most 500,000"),
    "a number without end": ("system: ball\nparameters: {a: " + "9" * 5000 + "}\n", "a number of 5000 digits; expected: fewer"),
    "the same in hexadecimal": ("system: ball\nname: 0x" + "f" * 5000, "a number of 5002 digits; expected: fewer"),
    "a power of powers": ("system: ball\nparameters: {a: 9**9**9**9}\n", "column 4: '9**9**9' has no finite real value"),
    "an object of python": ("system: !!python/object/apply:os.system [ls]\n", "the tag 'tag:yaml.org,2002:python/object/apply"),
    "a date that is none": ("system: ball\ntitle: 2001-13-45\n", "s.yaml:1:1: not readable as YAML: month must be in 1..12"),
    "a colour of a terminal": ('system: ball\ntitle: "\\e[31mred"\n', "s.yaml:2:8: the character '\\x1b' in a text; expected"),
    "half a character": ('system: ball\ntitle: "\\ud800"\n', "s.yaml:2:8: the character '\\ud800' in a text; expected"),
    "writing from the right": ("system: ball\ntitle: a\u202eb\n", "s.yaml:2:8: the character '\\u202e' in a text; expected"),
    "a name above": ("system: ball\nname: ../../x\n", "s.yaml:2:7: name is '../../x'; expected: String should match pattern"),
    "a name inside": ("system: ball\nname: a/../../x\n", "s.yaml:2:7: name is 'a/../../x'; expected: String should match"),
    "an absolute name": ("system: ball\nname: /etc/x\n", "s.yaml:2:7: name is '/etc/x'; expected: String should match pattern"),
    "a long name": ("system: ball\nname: " + "z" * 501, "expected: String should have at most 500 characters"),
    "a name of lines": ('system: ball\nfamilies: {"a\\nb": [BB]}\n', "'a\\nb' is not a name; expected: one line of text"),
    "a file that is not there": ("system: ball\nsystem: " + "z" * 300 + ".py:X\n", "the key 'system' is given twice"),
    "a system whose file has too long a name": ("system: " + "z" * 300 + ".py:X\n", "to load 'X' from; expected: path"),
    "a system in nobody's home": ("system: ~nobody_x/a.py:X\n", "to load 'X' from; expected: path"),
    "a system with a hole": ('system: "x\\0.py:X"\n', "s.yaml:1:9: the character '\\x00' in a text"),
    "points beyond memory": (
        "system: ball\nparameters: {a: 1}\n"
        "lyapunov: {parameter: a, from: 1, to: 2, points: 100000000000, starts: [{v: 1, phi: 1}]}\n",
        "s.yaml:3:50: points is 100000000000; expected: less than or equal to 100000",
    ),
    "a pattern that is too deep": (
        "system: ball\nparameters: {a: 1}\ngrid: {v: {from: 0, to: 1, points: 2}, phi: {from: 0, to: 1, points: 2}}\n"
        f"families: {{x: ['B{'(' * 2000}']}}\n",
        "s.yaml:4:15: the pattern B(((((((((((((((((((((((((((((((((((((((... is nested deeper than 50 levels",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_study_is_answered_by_a_line_and_nothing_is_written(kind: str) -> None:
    text, says = HOSTILE[kind]
    Path("s.yaml").write_text(text)
    for command in ("check", "run"):
        line = refused(command, "s.yaml")
        assert line.startswith("s.yaml:")
        assert says in line


def polynomial(file: str) -> str:
    return (
        "system: ball\nparameters: {a: 1}\ngrid: {v: {from: 0, to: 1, points: 2}, phi: {from: 0, to: 1, points: 2}}\n"
        f"composite: [{{name: a, where: v > 1, polynomial: '{file}#key'}}]\n"
    )


@pytest.mark.parametrize("file", ["../secret.yaml", "/etc/passwd", "below/../../secret.yaml", "link.yaml"])
def test_a_study_reads_no_file_outside_of_its_folder(file: str) -> None:
    Path("secret.yaml").write_text("key: {password: x}\n")
    Path("theirs").mkdir()
    Path("theirs/link.yaml").symlink_to(Path("secret.yaml").resolve())
    Path("theirs/s.yaml").write_text(polynomial(file))
    line = refused("check", "theirs/s.yaml")
    assert line.startswith(f"theirs/s.yaml:4:49: the file '{file}' is not in the study's folder")


def test_of_very_many_complaints_the_first_are_told() -> None:
    Path("s.yaml").write_text("system: ball\n" + "".join(f"k{n}: 1\n" for n in range(2000)))
    with pytest.raises(StudyError) as error:
        nsmaps.load_study("s.yaml")
    lines = str(error.value).splitlines()
    assert len(lines) == 21
    assert lines[-1] == "s.yaml: and 1980 more"


WORDS = st.sampled_from(
    [
        *Study.model_fields,
        "ball",
        "v",
        "phi",
        "a",
        "from",
        "to",
        "points",
        "BB",
        "exact",
        "pi/3",
        "9**9",
        "$\\frac{",
        "<b>",
        "../x",
    ]
)
LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | WORDS
DATA = st.recursive(LEAVES, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(WORDS, inner, max_size=4), max_leaves=12)
SIGNS = st.text(st.sampled_from(list("ab1-:&*!?|>%@`#,[]{}'\"\\ \n\t.<~=\x00\x85é")), max_size=60)
slowly = settings(deadline=None, max_examples=75, suppress_health_check=[HealthCheck.function_scoped_fixture])


@slowly
@given(st.sampled_from(list(Study.model_fields)), DATA)
@example("basins", {"grid": {}})
@example("grid", {"name": []})
def test_whatever_a_key_says_a_study_is_read_or_answered(key: str, value: Any) -> None:
    data = {"system": "ball", "parameters": {"a": 0.2}} | {key: value}
    Path("s.yaml").write_text(json.dumps(data), encoding="utf-8", errors="surrogatepass")
    read_or_answered()


@slowly
@given(SIGNS | SIGNS.map("system: ball\ntitle: {}".format) | st.binary(max_size=60))
def test_whatever_a_file_holds_it_is_read_or_answered(text: str | bytes) -> None:
    Path("s.yaml").write_bytes(text if isinstance(text, bytes) else text.encode())
    read_or_answered()


def read_or_answered() -> None:
    """The study s.yaml is read, or answered by lines that begin with its place."""
    lines = ["s.yaml: read"]
    try:
        assert nsmaps.load_study("s.yaml", installed_only=True).system == "ball"
    except StudyError as error:
        lines = str(error).splitlines()
    assert all(line.startswith("s.yaml:") for line in lines), lines


SMALL = "system: ball\nparameters: {a: 0.2, r: 1/2}\n"
GRID = "grid: {v: {from: 0.01, to: 0.5, points: 10000}, phi: {from: 0, to: 6, points: 10000}}\n"
HUGE = 10**12

# a section of a size beyond memory or time, and which of them is beyond
BEYOND = {
    "orbits": (f"orbits: [{{start: {{v: 0.3, phi: 1}}, n_returns: {HUGE}}}]\n", "memory"),
    "grid": (GRID, "memory"),
    "composite": (
        "composite: [{name: R, where: v > 0, family: low, fit: {full: {v: 1, phi: 1}}, " + GRID.strip() + "}]\n"
        "families: {low: [BB]}\n" + GRID.replace("10000", "10"),
        "memory",
    ),
    "bifurcation_diagram": (
        "bifurcation_diagram: {parameter: a, from: 0.2, to: 0.4, points: 100000, starts: [{v: 0.3, phi: 1}], "
        "transient: 10000000}\n",
        "time",
    ),
    "lyapunov": (
        f"lyapunov: {{parameter: a, from: 0.2, to: 0.4, points: 5, starts: [{{v: 0.3, phi: 1}}], n_returns: {HUGE}}}\n",
        "time",
    ),
    "branches": (
        f"branches: [{{name: b, parameter: a, bounds: [0.1, 1], start: {{v: 0.3, phi: 1}}, period: {HUGE}}}]\n",
        "memory",
    ),
    "parameter_plane": (
        "parameter_plane: {axes: {a: {from: 0.2, to: 0.4, points: 100000}, r: {from: 0.2, to: 0.4, "
        "points: 100000}}, starts: [{v: 0.3, phi: 1}]}\n",
        "memory",
    ),
    "basins": ("basins: {max_returns: 100000000}\n" + GRID.replace("10000", "100"), "time"),
    "noise": (
        f"noise: {{sigma: [0.1], tau: 1, start: {{v: 0.3, phi: 1}}, modes: {{x: [BB]}}, n_realisations: {HUGE}}}\n",
        "memory",
    ),
    "domains": (f"domains: [{{name: d, map: exact, box: {{v: [0.1, 0.3], phi: [0, 1]}}, max_updates: {HUGE}}}]\n", "memory"),
    "morse_sets": ("morse_sets: {box: {v: [0.1, 0.3], phi: [0, 1]}, n_cells: 1000000}\n", "memory"),
}


@pytest.mark.parametrize("section", BEYOND)
def test_what_is_beyond_memory_or_time_is_refused_before_anything_is_computed(section: str) -> None:
    text, what = BEYOND[section]
    Path("s.yaml").write_text(SMALL + text)
    line = 3
    for command in ("check", "run"):
        told = refused(command, "s.yaml", "--max-memory", "16")
        assert re.match(
            rf"s\.yaml:{line}:1: a run is estimated to need \S+ (GB|hours) of {what}, most of it for '{section}'; ", told
        ), told
    with pytest.raises(StudyError, match=message("study.limits", what=what, section=section)):
        nsmaps.run_study("s.yaml", max_memory=16)


def test_the_limits_can_be_raised_by_options_and_by_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("s.yaml").write_text(SMALL + "lyapunov: {parameter: a, from: 0.2, to: 0.4, points: 2, starts: [{v: 0.3, phi: 1}]}\n")
    assert "expected: at most 1e-06, or another limit by --max-hours or NSMAPS_MAX_HOURS" in refused(
        "check", "s.yaml", "--max-hours", "1e-6"
    )
    monkeypatch.setenv("NSMAPS_MAX_HOURS", "1e-6")
    assert "at most 1e-06" in refused("run", "s.yaml")
    assert CliRunner().invoke(app, ["check", "s.yaml", "--max-hours", "1"]).exit_code == 0
    monkeypatch.setenv("NSMAPS_MAX_HOURS", "inf")
    assert CliRunner().invoke(app, ["check", "s.yaml"]).exit_code == 0
    monkeypatch.setenv("NSMAPS_MAX_MEMORY", "much")
    assert refused("check", "s.yaml") == "NSMAPS_MAX_MEMORY is 'much'; expected: a positive number, or inf"
    with pytest.raises(NsmapsError, match=message("errors.value", name="NSMAPS_MAX_MEMORY", value=-1)):
        nsmaps.run_study("s.yaml", max_memory=-1)


def test_check_says_what_a_run_will_need() -> None:
    text = GRID.replace("10000", "30") + "partition: {tolerance: 1e-2}\n"
    Path("s.yaml").write_text(SMALL + text)
    last = CliRunner().invoke(app, ["check", "s.yaml"]).stdout.splitlines()[-1]
    told = r"  estimated, to a factor of ten: \S+ \S+ on one core and \S+ GB of memory, and what partition needs"
    assert re.fullmatch(told, last), last


@pytest.mark.parametrize("section", ["grid", "orbits", "bifurcation_diagram"])
def test_the_memory_is_estimated_to_a_factor_of_ten(section: str) -> None:
    texts = {
        "grid": GRID.replace("10000", "60") + "families: {low: [BB]}\n",
        "orbits": "orbits: [{start: {v: 0.3, phi: 1}, n_returns: 4000}]\n",
        "bifurcation_diagram": "bifurcation_diagram: {parameter: a, from: 0.2, to: 0.3, points: 20, starts: [{v: 0.3, phi: 1}], "
        "transient: 0, "
        "n_returns: 200}\n",
    }
    Path("s.yaml").write_text(SMALL + texts[section])
    study = nsmaps.load_study("s.yaml")
    estimated = total(sizes(study, study.system_object())).memory
    nsmaps.run_study(study, out="first")  # what is made once, such as the kernel, is no part of it
    tracemalloc.start()
    nsmaps.run_study(study, out="second")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak / 10 < estimated < peak * 10


def test_integrated_flights_are_estimated_to_take_longer() -> None:
    Path("s.yaml").write_text(SMALL + "orbits: [{start: {v: 0.3, phi: 1}, n_returns: 4000}]\n")
    study = nsmaps.load_study("s.yaml")
    closed, integrated = (sizes(study, system) for system in (study.system_object(), nsmaps.load_system("hopper")))
    assert total(integrated).seconds > 0
    assert total(integrated).seconds == pytest.approx(10 * total(closed).seconds)
    assert total(integrated).memory == total(closed).memory
