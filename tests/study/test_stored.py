"""Runs in tests/data: what they hold is read and says what the run said. `python tests/make_stored.py` writes them again."""

import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nsmaps
from nsmaps.study.store.archive import FORMAT
from nsmaps.study.store.serialize import stored_class
from nsmaps.study.study import Study

STORED = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}"
NAMES = sorted(folder.name for folder in STORED.iterdir())
YOUNGER = {
    "auxiliary_map",
    "auxiliary_exits",
    "reduced_basins",
    "same_attractor",
    "estimate",
    "basin_distance",
}  #: fields of results that no run of this format holds


@pytest.mark.parametrize("name", NAMES)
def test_a_stored_run_is_read_and_says_what_it_said(name: str) -> None:
    result = nsmaps.read_result(STORED / name)
    record = json.loads((STORED / name / "result.json").read_text())
    assert result.finished
    assert [verdict.text for verdict in result.verdicts] == [verdict["text"] for verdict in record["verdicts"]]
    assert list(result.timings) == list(record["timings"])
    with np.load(STORED / name / "arrays.npz", allow_pickle=False) as arrays:
        assert np.array_equal(result.returns.image, arrays["returns/image"], equal_nan=True)


def test_the_stored_runs_name_every_class_by_its_module() -> None:
    text = "".join(file.read_text() for file in STORED.glob("*/result.json"))
    names = set(re.findall(r'"\$": "([^"]*[A-Z]\w*)"', text))
    assert len(names) > 40
    assert all(f"{stored_class(name).__module__}:{stored_class(name).__qualname__}" == name for name in names)


def test_the_stored_runs_hold_every_field_of_a_result() -> None:
    found = set()
    for name in NAMES:
        result = nsmaps.read_result(STORED / name)
        found |= {name for name, part in result.items() if part not in (None, (), {})}
    unstored = {name for kind in Study.kinds().values() if not kind.stored for name in kind.results}
    assert set(Study.parts_of_result()) == found | YOUNGER | unstored
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
        assert arrays.files
        for path in arrays.files:
            field = path.split("/")[0]
            if not re.search(
                r"/codes$|bifurcation/.*/(scale|ends|length)$|surfaces?/(\w+/)?(member|returns/(start|turns|outcome))$", path
            ):
                kept = counted(arrays[path])
                assert any(kept <= each for each in held[field]), path
