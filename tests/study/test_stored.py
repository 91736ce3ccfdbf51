"""Run folders that were written when their format was new: every later version reads them.

A change that breaks one of these tests raises FORMAT and comes with a function that brings the older format to the newer;
the folders stay as they are, and the new format gets folders of its own. Their arrays were compressed, to be small.
"""

import inspect
import json
import pkgutil
import re
import shutil
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import nsmaps
from nsmaps.errors import NsmapsError
from nsmaps.results import Storable
from nsmaps.study.result import KEPT, StudyResult
from nsmaps.study.store.archive import FORMAT
from nsmaps.study.store.renewed import renewed
from nsmaps.study.store.serialize import HOME, is_ours, stored_class
from nsmaps.study.study import Study

STORED = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}"
NAMES = sorted(folder.name for folder in STORED.iterdir())
YOUNGER = {
    "agreement",
    "auxiliary_map",
    "auxiliary_exits",
    "reduced_basins",
    "same_attractor",
}  #: fields of results that no run of this format holds
ABSTRACT = {"Region", "ReturnMap"}  #: of which a file holds subclasses only


def modules() -> Iterator[ModuleType]:
    """Every module of the rooms whose results a run can keep."""
    for found in pkgutil.walk_packages(nsmaps.__path__, "nsmaps."):
        if found.name.split(".")[1] in {home.split(".")[1] for home in HOME.values()}:
            yield import_module(found.name)


@pytest.mark.parametrize("name", NAMES)
def test_a_stored_run_is_read_and_says_what_it_said(name: str) -> None:
    result = nsmaps.read_result(STORED / name)
    record = json.loads((STORED / name / "result.json").read_text())
    assert result.finished
    assert [verdict.text for verdict in result.verdicts] == [verdict["text"] for verdict in record["verdicts"]]
    assert list(result.timings) == list(record["timings"])
    with np.load(STORED / name / "arrays.npz", allow_pickle=False) as arrays:
        assert np.array_equal(result.returns.image, arrays["returns/image"], equal_nan=True)


def test_the_stored_runs_hold_every_class_that_a_run_can_keep() -> None:
    text = "".join(file.read_text() for file in STORED.glob("*/result.json"))
    found = {stored_class(name).__name__ for name in set(re.findall(r'"\$": "((?:[\w.]+:)?[A-Z]\w*)"', text))}
    assert set(HOME) <= found | {
        "Agreement",
        "Margin",
        "SpecialPoint",
        "Alphabet",
        "AtBorder",
        "AuxiliaryOrbit",
        "AuxiliaryRegion",
    }  # no study requests the first, tests of curves read the second, the others are younger than the runs
    missing = [name for name, module in HOME.items() if not hasattr(import_module(module), name)]
    assert missing == []


def test_every_class_that_a_result_may_hold_has_a_stored_name() -> None:
    """Followed through the annotations of the fields that are kept, and of those of the classes found there."""
    waiting, found = [str(StudyResult.__annotations__[name]) for name in KEPT], set()
    classes = {
        name: cls
        for module in modules()
        for name, cls in vars(module).items()
        if inspect.isclass(cls) and cls.__module__.startswith("nsmaps.") and is_ours(cls)
    }
    classes |= {name: getattr(import_module(home), name) for name, home in HOME.items()}
    while waiting:
        for name in set(re.findall(r"\w+", waiting.pop())) & set(classes) - found:
            found.add(name)
            unstored = getattr(classes[name], "unstored", ())
            rows = [row for base in classes[name].__mro__ for row in vars(base).get("__annotations__", {}).items()]
            waiting += [str(text) for field, text in rows if field not in unstored]
    assert {name for name in found - ABSTRACT if not issubclass(classes[name], Storable)} <= set(HOME)
    assert len(found) > 40


def test_the_stored_runs_hold_every_field_of_a_result() -> None:
    found = set()
    for name in NAMES:
        result = nsmaps.read_result(STORED / name)
        found |= {field for field in KEPT if getattr(result, field) not in (None, (), {})}
    assert set(KEPT) == found | YOUNGER
    assert found & YOUNGER == set()


def counted(array: Any) -> Counter[Any]:
    """How often each finite value is in an array."""
    values = np.asarray(array)
    if values.dtype.kind in "USO":
        return Counter(map(str, values.ravel().tolist()))
    parts = np.stack([values.real, values.imag]) if values.dtype.kind == "c" else values
    return Counter(parts[np.isfinite(parts)].astype(float).tolist())


@pytest.mark.parametrize("name", NAMES)
def test_every_stored_array_is_in_the_xarray_tree_of_its_field(name: str) -> None:
    """Except for codes, which are words there."""
    pytest.importorskip("xarray")
    held: dict[str, list[Counter[Any]]] = {}
    for node in nsmaps.read_result(STORED / name).to_xarray().subtree:
        held.setdefault(node.path.split("/")[1], []).extend(counted(array) for array in node.variables.values())
    with np.load(STORED / name / "arrays.npz", allow_pickle=False) as arrays:
        for path in arrays.files:
            field = path.split("/")[0]
            if not path.endswith("/codes"):
                kept = counted(arrays[path])
                assert any(kept <= each for each in held[Study.was.get(field, field)]), path


def test_a_stored_study_is_read_under_the_keys_of_today() -> None:
    long, run = (nsmaps.read_result(STORED / name).study for name in ("long", "run"))
    assert (long.exit_times.cells, long.stability.discard, long.lyapunov.discard, long.noise.impacts.discard) == (6, 200, 10, 4)
    assert (run.bifurcation.map, run.bifurcation.discard) == (("exact", "composite"), 10)
    with pytest.raises(NsmapsError, match=r"study\.yaml:89:1: 'transient' is now 'exit_times'"):
        nsmaps.load_study(STORED / "long" / "study.yaml")
    assert renewed({"figures": ["words", "transient"]}, Study) == {"figures": ["words", "exit_times"]}


def test_maps_of_a_stored_run_are_maps() -> None:
    result = nsmaps.read_result(STORED / "run")
    assert result.composite.coordinates == result.returns.coordinates == result.system.coordinates
    numbers = json.loads((STORED / "run" / "result.json").read_text())["numbers"]
    start = result.orbits[0].start
    again = nsmaps.orbit(result.composite, start, 6)
    assert again.final == pytest.approx(numbers["orbits"][0]["composite"], abs=1e-12)
    assert result.parametric.at(0.35).first_return([start]).valid.all()
    assert str(result.second_iterate.expr) == numbers["second_iterate"]["expr"]
    assert set(result.bifurcation) == {"exact", "composite"}
    parts = nsmaps.read_result(STORED / "partition")
    assert nsmaps.orbit(parts.composite, [0.8, 0.3], 5).states.shape == (6, 2)
    strips = nsmaps.read_result(STORED / "accurate")
    state = [[0.9, 0.35]]
    exact = strips.system.first_return(state).image
    assert strips.reduced.first_return(state).image == pytest.approx(exact, abs=1e-2)


@pytest.mark.parametrize(
    ("found", "says"), [(FORMAT + 1, "a newer nsmaps reads it"), (1, "run the study again"), (None, "run the study again")]
)
def test_another_format_says_what_to_do(found: int | None, says: str) -> None:
    folder = shutil.copytree(STORED / "run", "other")
    file = Path(folder, "result.json")
    file.write_text(json.dumps(json.loads(file.read_text()) | {"format": found}))
    with pytest.raises(NsmapsError, match=rf"has format {found}; expected: {FORMAT}; .*{says}; written by nsmaps 0\.1\.0"):
        nsmaps.read_result(folder)


def test_a_record_that_does_not_fit_its_format_is_an_error_of_nsmaps() -> None:
    folder = shutil.copytree(STORED / "run", "other")
    file = Path(folder, "result.json")
    record = json.loads(file.read_text())
    record["objects"]["tomorrow"] = None
    file.write_text(json.dumps(record))
    with pytest.raises(NsmapsError, match=r"not as this nsmaps reads it: .*tomorrow.*; written by nsmaps 0\.1\.0"):
        nsmaps.read_result(folder)


def test_show_versions_tells_where_it_runs(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NSMAPS_CACHE_DIR", str(Path("kernels").resolve()))
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    nsmaps.show_versions()
    told = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert told["kernels"] == str(Path("kernels").resolve())
    assert "OMP_NUM_THREADS=3" in told["threads"]
    assert {"python", "platform", "nsmaps", "numpy", "numba", "xarray", "heyoka", "cores"} <= set(told)
    assert int(told["cores"]) >= 1
