"""Run folders and exported maps of strangers: read, or answered by a line; nothing of them is run or becomes markup."""

import ast
import json
import pickle
import re
import shutil
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from messages import message
from stored import write_study
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import NsmapsError
from nsmaps.reduced.composite.composite import Piece
from nsmaps.report.page import write_report
from nsmaps.study.store.run_folder import clear

STORED = Path(__file__).parents[1] / "data" / "run-format-4"
slowly = settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])


class Bomb:
    """What leaves a mark where it is unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (Path("mark"),)


def refused(folder: str = "out") -> str:
    """The line with which every command refuses a folder; nothing is written, and no pickle was opened."""
    before = sorted(Path().rglob("*"))
    lines = set()
    for command in (["figures"], ["report"], ["show"], ["export", "--to", "c"], ["cite"]):
        answer = CliRunner().invoke(app, [command[0], folder, *command[1:]])
        assert (answer.exit_code, answer.stdout) == (2, ""), answer.output
        assert answer.stderr.count("\n") == 1, answer.stderr
        lines.add(answer.stderr.strip())
    assert sorted(Path().rglob("*")) == before
    assert not Path("mark").exists()
    (line,) = lines
    return line


def with_record(change: Callable[[dict[str, Any]], Any]) -> None:
    """A stored run in the folder `out`, its record changed."""
    shutil.copytree(STORED / "run", "out", dirs_exist_ok=True)
    record = json.loads((STORED / "run" / "result.json").read_text())
    change(record)
    Path("out/result.json").write_text(json.dumps(record))


def arrays_of(**arrays: Any) -> None:
    """A stored run in the folder `out` with other arrays."""
    shutil.copytree(STORED / "run", "out")
    with open("out/arrays.npz", "wb") as file:
        np.savez(file, **arrays)


def test_pickled_arrays_are_refused_and_not_opened() -> None:
    arrays_of(x=np.array([Bomb()], dtype=object))
    assert "arrays.npz cannot be read (Object arrays cannot be loaded when allow_pickle=False)" in refused()
    Path("out/arrays.npz").write_bytes(pickle.dumps(Bomb()))
    assert "arrays.npz cannot be read (File is not a zip file)" in refused()


def test_arrays_beyond_memory_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(STORED / "run", "out")
    with zipfile.ZipFile("out/arrays.npz", "w", zipfile.ZIP_DEFLATED) as packed, packed.open("x.npy", "w") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (10**13,)})
    assert "arrays.npz cannot be read" in refused()  # 80 TB, as its header says, in a file of 100 bytes
    monkeypatch.setenv("NSMAPS_MAX_MEMORY", "1e-4")
    with zipfile.ZipFile("out/arrays.npz", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("x.npy", bytes(10**6))
    line = "arrays.npz cannot be read (0.001 GB of arrays; expected: at most 0.0001, or the value of NSMAPS_MAX_MEMORY)"
    assert line in refused()


RECORDS: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "a class of others": (
        lambda r: r["objects"].update(basins={"$": "subprocess:Popen", "args": "ls"}),
        "names the class 'subprocess:Popen'; expected: results and specs of nsmaps",
    ),
    "a class of another room": (lambda r: r["objects"].update(basins={"$": "nsmaps.bench.comparison:Race"}), "names the class"),
    "a class that nsmaps imports": (
        lambda r: r["objects"].update(basins={"$": "nsmaps.study.store.serialize:BaseModel"}),
        "names the class 'nsmaps.study.store.serialize:BaseModel'",
    ),
    "a closed form, whose fields sympy would evaluate": (
        lambda r: r["objects"].update(composite={"$": "nsmaps.symbolic.curve_iterates:HeldIterate", "held": ["1"]}),
        "names the class 'nsmaps.symbolic.curve_iterates:HeldIterate'",
    ),
    "a class that is not there": (
        lambda r: r["objects"].update(basins={"$": "nsmaps.exact.x:Y"}),
        "names the class 'nsmaps.exact.x:Y'",
    ),
    "an array that is not there": (lambda r: r["objects"].update(basins={"$": "array", "value": "x"}), "KeyError"),
    "no kind": (lambda r: r["objects"].update(basins={"a": 1}), "KeyError: '$'"),
    "no times": (lambda r: r.update(timings={"system": "long"}), "timings.system"),
    "verdicts of other fields": (lambda r: r["verdicts"].append({"name": "x"}), "Field required"),
    "a control character": (lambda r: r["verdicts"][0].update(text="\x1b[2J"), "the character '\\x1b' in a text; expected"),
    "half a character": (lambda r: r["verdicts"][0].update(name="\ud800"), "the character '\\ud800' in a text; expected"),
}


@pytest.mark.parametrize("kind", RECORDS)
def test_a_record_that_no_run_wrote_is_answered_by_a_line(kind: str) -> None:
    change, says = RECORDS[kind]
    with_record(change)
    assert says in refused()


@pytest.mark.parametrize(
    ("text", "says"), [("[" * 100_000, "nested too deeply"), ("[1]", "has format None"), ("{", "cannot be read")]
)
def test_a_record_that_is_none_is_answered_by_a_line(text: str, says: str) -> None:
    shutil.copytree(STORED / "run", "out")
    Path("out/result.json").write_text(text)
    assert says in refused()


ODD = st.none() | st.integers() | st.floats() | st.text(max_size=6) | st.lists(st.integers(), max_size=2) | st.just({"$": "dict"})


def places(data: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Every place in nested data."""
    inside = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return [path, *(place for key, value in inside for place in places(value, (*path, key)))]


RECORD = json.loads((STORED / "run" / "result.json").read_text())
PLACES = [place for place in places({key: RECORD[key] for key in RECORD if key != "numbers"}) if place]


@slowly
@given(st.sampled_from(PLACES), ODD)
def test_whatever_a_record_says_a_report_is_written_or_a_line_told(place: tuple[Any, ...], value: Any) -> None:
    def change(record: Any) -> None:
        for key in place[:-1]:
            record = record[key]
        record[place[-1]] = value

    with_record(change)
    answer = CliRunner().invoke(app, ["report", "out"])
    assert answer.exit_code in (0, 2), answer.output
    assert answer.exit_code == 0 or answer.stderr.count("\n") == 1, answer.stderr


@slowly
@given(st.binary(max_size=40) | st.binary(max_size=40).map(lambda end: (STORED / "run" / "arrays.npz").read_bytes()[:-30] + end))
def test_whatever_arrays_hold_they_are_read_or_a_line_told(content: bytes) -> None:
    shutil.copytree(STORED / "run", "out", dirs_exist_ok=True)
    Path("out/arrays.npz").write_bytes(content)
    with pytest.raises(NsmapsError, match=message("study.unread", file="out/arrays.npz")):
        nsmaps.read_result("out")


def test_markup_of_a_run_is_shown_as_text() -> None:
    hostile = "<script>alert(1)</script><img src=x onerror=alert(1)>"
    with_record(
        lambda r: [r["verdicts"][0].update(name=hostile, of=hostile, text=f"yes: {hostile}"), r["versions"].update(x=hostile)]
    )
    text = Path("out/study.yaml").read_text()
    write_study("out", re.sub(r"(?m)^title: .*$", f"title: '{hostile}'", text))
    page = write_report(nsmaps.read_result("out"), Path("out")).read_text()
    assert "<script" not in page
    assert "<img src=x" not in page
    assert page.count("&lt;script&gt;alert(1)") >= 5


@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\nIEND\xaeB`\x82", b"<svg onload=alert(1)>"])
def test_a_figure_that_is_no_picture_is_not_put_into_a_report(content: bytes) -> None:
    shutil.copytree(STORED / "run", "out")
    name = nsmaps.read_result("out").study.figures[0]
    Path("out/figures").mkdir(exist_ok=True)
    Path(f"out/figures/{name}.png").write_bytes(content)
    assert CliRunner().invoke(app, ["report", "out"]).exit_code == 0
    page = Path("out/report.html").read_text()
    assert f"{name}.png is incomplete" in page
    assert "data:image/png" not in page


@pytest.mark.parametrize("name", [r"$\frac{$", r"$\input{/etc/passwd}$", "$" * 99, "$" + "{" * 97 + "$", "a_$x^", r"\$x$ & 50 %"])
def test_a_name_that_is_no_mathematics_is_drawn_as_it_stands(name: str, tmp_path: Path) -> None:
    from nsmaps.figures.page import Sheet

    def panel(ax: Any) -> Any:
        ax.plot([0, 1], [0, 1], label=f"{name}, $v$")
        ax.set(xlabel=name, ylabel=r"$\phi_{k+1}$", title=name)
        ax.legend()
        return ax

    sheet = Sheet("odd", (panel,), 1, title=name)
    for path in sheet.save(tmp_path, ("png", "svg", "pdf"), 40):
        assert path.stat().st_size > 1000
    (ax,) = sheet.figure().axes
    assert ax.yaxis.label.get_parse_math()


def test_no_name_becomes_tex_that_is_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import matplotlib

    from nsmaps.figures.page import Sheet

    monkeypatch.setitem(matplotlib.rcParams, "text.usetex", True)
    used: list[bool] = []
    Sheet("one", (lambda ax: used.append(ax.title.get_usetex()) or ax,), 1).save(tmp_path, ("png",), 20)
    assert used == [False]


@pytest.mark.parametrize(
    "listed", [b"../keep.txt", b"/keep.txt", b"link/keep.txt", b"export", b"a\0b", b"\xff\xfe", b"z" * 5000, b".", b"", b"out/.."]
)
def test_a_list_of_what_was_drawn_removes_nothing_outside_and_stops_no_run(listed: bytes) -> None:
    kept = Path("keep.txt")
    kept.write_text("kept")
    shutil.copytree(STORED / "run", "out")
    Path("out/link").symlink_to(Path().resolve())
    Path("out/export").mkdir()
    Path("out/export/mine.c").write_text("mine")
    Path("out/written.txt").write_bytes(listed.replace(b"/keep", f"{kept.resolve().parent}/keep".encode(), listed[:1] == b"/"))
    clear(Path("out"))
    assert kept.read_text() == "kept"
    assert Path("out/export/mine.c").read_text() == "mine"
    assert not Path("out/result.json").exists()


@pytest.mark.parametrize("text", ["[" * 100_000, "{", "null", "\xff"])
def test_a_folder_whose_record_is_none_is_not_written_to(text: str) -> None:
    Path("out").mkdir()
    Path("out/result.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(NsmapsError, match=message("study.no-run")):
        nsmaps.run_study("ball/drop", out="out")


@pytest.mark.parametrize("out", ["nowhere\0", "z" * 300, "taken"])
def test_an_out_folder_that_cannot_be_is_told_before_anything_is_computed(out: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("taken").write_text("a file")
    monkeypatch.setattr("nsmaps.study.run.compute_step", None)
    with pytest.raises((NsmapsError, OSError)):
        nsmaps.run_study("ball/drop", out=out)


LOGISTIC = nsmaps.reduced.PolyMap.of_monomials(("x",), {"x": {(1,): 4, (2,): -4}}, [[0, 1]])


def exported(path: str, change: Callable[[dict[str, Any]], Any]) -> str:
    """What `load_map` says of an exported map that was changed."""
    made = nsmaps.symbolic.symbolic_iterate(LOGISTIC, 2) if path == "images" else LOGISTIC
    data = json.loads(nsmaps.export(made, "json"))
    change(data)
    Path("map.json").write_text(json.dumps(data))
    with pytest.raises(NsmapsError, match=message("study.at", place=re.compile(r"^map\.json"))) as error:
        nsmaps.load_map("map.json")
    return str(error.value)


@pytest.mark.parametrize(
    ("kind", "change", "says"),
    [
        ("outputs", lambda d: d["outputs"][0].update(exponents=[[10**9]], coefficients=[1.0]), message("exports.powers")),
        (
            "outputs",
            lambda d: d["outputs"][0].update(exponents=[[-1]], coefficients=[1.0]),
            message("exports.powers", low=-1, high=-1),
        ),
        (
            "outputs",
            lambda d: d["outputs"][0].update(coefficients=[1.0]),
            message("errors.shape", what="an array of", shape="(1,)"),
        ),
        (
            "outputs",
            lambda d: d.update(scale=[1.0, 2.0]),
            message("errors.shape", what="an array of", shape="(2,)", expected="(1,)"),
        ),
        ("outputs", lambda d: d["coordinates"][0].update(name="x\nimport os"), message("exports.not-a-name")),
        ("outputs", lambda d: d["coordinates"][0].update(name="x" * 10**6), message("exports.not-a-name")),
        ("images", lambda d: d["images"]["x"].update(exponents=[[10**9]], coefficients=["1"]), message("exports.powers")),
        (
            "images",
            lambda d: d["images"]["x"]["coefficients"].__setitem__(0, "1e999999999"),
            message("exports.fraction"),
        ),
        (
            "images",
            lambda d: d["images"]["x"]["coefficients"].__setitem__(0, "9" * 5000),
            message("exports.fraction"),
        ),
        ("images", lambda d: d["images"]["x"]["coefficients"].__setitem__(0, "1/0"), message("exports.fraction")),
        (
            "images",
            lambda d: d["images"]["x"]["coefficients"].__setitem__(0, "__import__('os')"),
            message("exports.fraction"),
        ),
    ],
)
def test_an_exported_map_that_was_changed_is_answered_by_a_line(kind: str, change: Callable[[Any], Any], says: str) -> None:
    assert re.search(says, exported(kind, change))


@pytest.mark.parametrize("text", ["[" * 10**5, "{", "[]", '{"schema": "nsmaps", "version": 1, "kind": []}', "9" * 5000])
@pytest.mark.parametrize("name", ["map.json", "map.py"])
def test_a_file_that_is_no_map_is_answered_by_a_line(text: str, name: str) -> None:
    Path(name).write_text(text if name.endswith("json") else f"import os\nos.mkdir('mark')\nMAP = {text}\n")
    with pytest.raises(NsmapsError, match=rf"^{re.escape(name)}[^\n]*$"):
        nsmaps.load_map(name)
    assert not Path("mark").exists()


@pytest.mark.parametrize("name", ["map.json", "map.py"])
@pytest.mark.parametrize("where", ["held", "domain", "curves", "symbols", "variable"])
def test_no_text_of_an_exported_map_is_evaluated(name: str, where: str) -> None:
    """Sympy evaluates texts that it takes for formulas, with all of python at hand."""
    hostile = "__import__('pathlib').Path('mark').touch()"
    data = json.loads(nsmaps.export(nsmaps.read_result(STORED / "run").second_iterate, "json"))
    data |= {"symbols": {"symbols": [hostile]}, "variable": {"variable": hostile}}.get(where, {})
    if where == "curves":
        data["curves"][0]["coefficients"][0] = hostile
    elif where in ("held", "domain"):
        data["held"] = [dict.fromkeys(values, hostile) if where == "held" else values for values in data["held"]]
        data["domain"] = dict.fromkeys(data["domain"], [hostile] * 2) if where == "domain" else data["domain"]
    Path(name).write_text(json.dumps(data) if name.endswith("json") else f"MAP = {data!r}\n")
    with suppress(NsmapsError, AttributeError, KeyError):
        made = nsmaps.load_map(name)
        made.at(**{hostile: 1.0})
    assert not Path("mark").exists()
    if where in ("held", "domain", "curves"):
        said = message("exports.fraction") if where == "curves" else message("exports.number")
        with pytest.raises(NsmapsError, match=said):
            nsmaps.load_map(name)


def test_no_text_is_taken_for_a_formula() -> None:
    from nsmaps.symbolic.formula import exact

    with pytest.raises(ValueError, match=message("others.sympify")):
        exact("__import__('pathlib').Path('mark').touch()")
    assert not Path("mark").exists()


NAMES = st.text(st.sampled_from(list("aR1+'\"\\*/#%{}()$`;~ \n\té=-")), min_size=1, max_size=12)


@slowly
@given(NAMES)
def test_no_name_of_a_piece_becomes_code(name: str) -> None:
    odd, plain = (composite_of(each) for each in (name, "R1"))
    modules = [[type(node) for node in ast.parse(nsmaps.export(each, "python")).body] for each in (odd, plain)]
    assert modules[0] == modules[1]
    sources = [[bare(text) for text in nsmaps.export(each, "c").values()] for each in (odd, plain)]
    assert sources[0] == sources[1]


def composite_of(name: str) -> nsmaps.CompositeMap:
    """A composite map of one piece of this name."""
    box = nsmaps.Box(coordinates=("x",), bounds={"x": (0, 1)})
    return nsmaps.CompositeMap(("x",), ("B",), (Piece(name, box, LOGISTIC, "BB"),))


def bare(source: str) -> str:
    """A program in C without comments, all its words alike."""
    return re.sub(r"[A-Za-z_]\w*", "w", re.sub(r"/\*.*?\*/", "", source, flags=re.DOTALL))
