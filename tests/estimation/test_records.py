"""Records as they are read and checked: one line of advice for each fault, and units."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nsmaps.errors import DataError
from nsmaps.estimation import Record
from nsmaps.estimation.records import records_of


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "the record has no impacts and no samples; expected: times of impacts"),
        ({"times": [1.0, 3.0, 2.0]}, r"times decrease from 3 to 2 \(numbers 2 and 3\); expected: one motion in order"),
        ({"times": [1.0, np.nan]}, "number 2 of times is nan; expected: finite times"),
        ({"times": [1.0], "walls": "BT"}, "2 walls for 1 impacts; expected: one for each"),
        ({"times": [1.0], "noise": 0.0}, "noise 1 is 0; expected: a finite standard deviation above zero"),
        ({"times": [1.0], "noise": np.inf}, "noise 1 is inf; expected: a finite standard deviation above zero"),
        ({"times": [2.0, 2.0]}, "all 2 times are 2; expected: times that increase"),
        ({"times": [1.0], "speeds": [2.0]}, "speed_noise 1 is nan; expected: a finite standard deviation above zero"),
        ({"times": [1.0], "speeds": [-2.0], "speed_noise": 0.1}, "speed -2 is negative; expected: impact speeds"),
        ({"times": [1.0], "time_unit": 0.0}, "time_unit is 0.0; expected: the system's unit"),
        ({"times": [1.0], "time_unit": "s"}, "time_unit is 's'; expected: the system's unit"),
        ({"times": [1.0], "phase": np.nan}, "phase is nan; expected: radians at time zero, or None"),
        ({"times": ["1", "a"]}, "number 2 of times is 'a'; expected: numbers, with a decimal point"),
        (
            {"times": np.array(["2026-01-01"], "M8[ns]")},
            r"times are of type datetime64\[ns\]; expected: numbers, as \(t - t\[0\]\)",
        ),
        ({"sample_times": [1.0]}, "sample_times without samples"),
        ({"times": [1.0], "name": "run 7", "length_unit": -1}, "record 'run 7': length_unit is -1"),
    ],
)
def test_a_record_that_cannot_be_used_is_refused_with_advice(given: dict[str, Any], message: str) -> None:
    with pytest.raises(DataError, match=message) as error:
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
    with pytest.raises(DataError, match=r"nowhere\.csv cannot be read"):
        Record.read(tmp_path / "nowhere.csv")
    path = tmp_path / "rig.csv"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(DataError, match=r"rig\.csv cannot be read: it is not a text file"):
        Record.read(path)
    path.write_text("tme,wall\n1,B\n")
    with pytest.raises(DataError, match="no column 'time'; the columns are tme, wall, did you mean 'tme'"):
        Record.read(path)
    path.write_text("time,wall\n1,B\n2\n")
    with pytest.raises(DataError, match="row 2: 1 values for 2 columns"):
        Record.read(path)


def test_several_records_are_given_as_a_sequence() -> None:
    assert [len(one.times) for one in records_of([[1.0, 2.0], Record.of([1.0]), {"time": [1.0, 2.0, 3.0]}])] == [2, 1, 3]
    assert len(records_of([1.0, 2.0, 3.0])[0].times) == 3
