"""Records as they are read and checked: one line of advice for each fault, and units."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from messages import message

from nsmaps.errors import DataError
from nsmaps.estimation import Record
from nsmaps.estimation.records import records_of


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, message("estimation.empty")),
        ({"times": [1.0, 3.0, 2.0]}, message("estimation.decreasing", what="times", before=3, after=2, first=2, second=3)),
        ({"times": [1.0, np.nan]}, message("estimation.not-finite", nth=2, what="times", value="nan")),
        ({"times": [1.0], "walls": "BT"}, message("estimation.walls", number=2, count=1)),
        ({"times": [1.0], "noise": 0.0}, message("estimation.noise", name="noise", nth=1, value=0)),
        ({"times": [1.0], "noise": np.inf}, message("estimation.noise", name="noise", nth=1, value="inf")),
        ({"times": [2.0, 2.0]}, message("estimation.constant", number=2, what="times", value=2)),
        ({"times": [1.0], "speeds": [2.0]}, message("estimation.noise", name="speed_noise", nth=1, value="nan")),
        ({"times": [1.0], "speeds": [-2.0], "speed_noise": 0.1}, message("estimation.negative-speed", speed=-2)),
        ({"times": [1.0], "time_unit": 0.0}, message("estimation.unit", name="time_unit", value=0.0)),
        ({"times": [1.0], "time_unit": "s"}, message("estimation.unit", name="time_unit", value="'s'")),
        ({"times": [1.0], "phase": np.nan}, message("estimation.phase", phase="nan")),
        ({"times": ["1", "a"]}, message("estimation.not-a-number", nth=2, what="times", value="'a'")),
        (
            {"times": np.array(["2026-01-01"], "M8[ns]")},
            message("estimation.wrong-type", what="times", type="datetime64[ns]"),
        ),
        ({"sample_times": [1.0]}, message("estimation.times-without-samples")),
        (
            {"times": [1.0], "name": "run 7", "length_unit": -1},
            message("errors.value", name="length_unit", value=-1, at="record 'run 7'"),
        ),
    ],
)
def test_a_record_that_cannot_be_used_is_refused_with_advice(given: dict[str, Any], said: str) -> None:
    with pytest.raises(DataError, match=said) as error:
        Record.of(**given)
    assert "\n" not in str(error.value)


def test_a_csv_file_a_mapping_and_a_dataset_give_the_same_record(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    path = tmp_path / "rig.csv"
    path.write_text("# a rig\ntime,wall,speed,noise,speed_noise\n0.5,B,1.25,0.01,0.1\n1.5,,,0.01,\n")
    sheet, tabs = tmp_path / "sheet.csv", tmp_path / "tabs.txt"  # as spreadsheets write them, some with decimal commas
    sheet.write_text(path.read_text().replace(",", ";").replace(".", ","), encoding="utf-8-sig")
    tabs.write_text(path.read_text().replace(",", "\t"))
    columns = {
        "time": [0.5, 1.5],
        "wall": ["B", ""],
        "speed": [1.25, np.nan],
        "noise": [0.01, 0.01],
        "speed_noise": [0.1, np.nan],
    }
    dataset = xarray.Dataset({key: ("impact", value) for key, value in columns.items()})
    one, other, third = Record.read(path, name="a"), Record.read(columns), Record.read(dataset)
    for record in (other, third, Record.read(sheet), Record.read(tabs)):
        for name in ("times", "walls", "speeds", "noise", "speed_noise"):
            np.testing.assert_array_equal(getattr(one, name), getattr(record, name))
    assert str(one) == "a: 2 impacts, time 0.5 to 1.5"
    assert one.to_xarray().times.values.tolist() == [0.5, 1.5]


def test_columns_that_are_not_of_impacts_are_sampled_states(tmp_path: Path) -> None:
    path = tmp_path / "strobe.csv"
    path.write_text("time,x,x_noise\n0,1.0,0.1\n2,,0.1\n4,3.0,0.2\n")
    record = Record.read(path)
    np.testing.assert_array_equal(record.samples["x"], [1.0, np.nan, 3.0])
    np.testing.assert_array_equal(record.sample_noise["x"], [0.1, 0.1, 0.2])
    assert len(record.times) == 0


def test_files_that_are_no_records_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=message("estimation.unread", file=re.compile(r".*nowhere\.csv"))):
        Record.read(tmp_path / "nowhere.csv")
    path = tmp_path / "rig.csv"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(
        DataError, match=message("estimation.unread", file=re.compile(r".*rig\.csv"), reason="it is not a text file")
    ):
        Record.read(path)
    path.write_text("tme,wall\n1,B\n")
    with pytest.raises(DataError, match=message("estimation.no-times", name="time", columns="tme, wall", near="tme")):
        Record.read(path)
    path.write_text("time,wall\n1,B\n2\n")
    with pytest.raises(DataError, match=message("estimation.row", row=2, values=1, columns=2)):
        Record.read(path)


def test_several_records_are_given_as_a_sequence() -> None:
    assert [len(one.times) for one in records_of([[1.0, 2.0], Record.of([1.0]), {"time": [1.0, 2.0, 3.0]}])] == [2, 1, 3]
    assert len(records_of([1.0, 2.0, 3.0])[0].times) == 3
