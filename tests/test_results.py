"""Results declare their arrays once: datasets, pages of notebooks and files follow from that."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pytest
from messages import message

from nsmaps import Angle, NsmapsError
from nsmaps.arrays import Floats
from nsmaps.exact import Coordinates
from nsmaps.results import Result, array, array_property, datasets, tree
from nsmaps.study.store.serialize import Arrays, decode, encode

pytest.importorskip("xarray")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Heights(Result):
    """Heights over the values of a parameter."""

    coordinates: Coordinates
    parameter: str
    values: Floats = field(metadata=array("value", "values of the parameter", name="parameter"))
    states: Floats = field(metadata=array("value ... coordinate", "last states"))
    phases: Floats | None = field(default=None, metadata=array("value", "complex amplitudes", "m"))
    label: str = "a label"
    units: dict[str, str] = field(default_factory=dict)

    @array_property("value", "squares of the values", "1")
    def squares(self) -> Floats:
        """The squares of the values, shape (V,)."""
        return self.values**2


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Pair(Result):
    """Two results."""

    heights: tuple[Heights, ...]
    picture: ClassVar[str] = ""


def heights(phases: Floats | None = None) -> Heights:
    names = Coordinates(("v", Angle("phi")))
    return Heights(names, "d", np.array([0.1, 0.2, 0.3]), np.zeros((3, 4, 2)), phases, units={"v": "m/s", "d": "mm"})


def test_a_dataset_has_the_names_and_units_of_the_parameter_and_of_the_coordinates() -> None:
    found = heights(np.array([1j, 2, 3])).to_xarray()
    assert found.states.dims == ("d", "axis_0", "coordinate")
    assert (found.d.values.tolist(), found.d.units) == ([0.1, 0.2, 0.3], "mm")
    assert (found.coordinate.values.tolist(), found.unit.values.tolist()) == (["v", "phi"], ["m/s", "rad"])
    assert found.squares.values.tolist() == (np.array([0.1, 0.2, 0.3]) ** 2).tolist()
    assert found.phases.dims == ("d", "part")
    assert (found.phases.values[0].tolist(), found.phases.units) == ([0.0, 1.0], "m")
    assert (found.label, found.states.long_name) == ("a label", "last states")


def test_results_within_a_result_are_a_tree() -> None:
    pair = Pair((heights(), heights()))
    assert [path for path, _ in datasets({"a/b": pair}, "x")] == ["x/a|b/heights/0", "x/a|b/heights/1"]
    assert tree({"x": pair}, study="s")["x/heights/1"].d.values.tolist() == [0.1, 0.2, 0.3]


def test_a_notebook_shows_each_array_with_its_axes() -> None:
    page = heights()._repr_html_()
    assert "<td>states</td><td>value 3, axis_0 4, coordinate 2</td><td>last states</td>" in page
    assert "<td>phases</td>" not in page


def test_a_class_without_a_picture_says_so() -> None:
    with pytest.raises(NsmapsError, match=message("results.no-picture", result="Heights")):
        heights().plot()


def test_only_storable_classes_of_known_packages_are_read() -> None:
    from nsmaps.exact.returns import Margin

    arrays: Arrays = {}
    stored = encode(Margin(np.zeros(2), np.ones(2)), "margin", arrays)
    assert decode(stored, arrays).slowest.tolist() == [1.0, 1.0]
    for name in ("os:system", "tests.test_results:Heights", "nsmaps.results:array", "nsmaps.progress:Work"):
        with pytest.raises(NsmapsError, match=message("study.class-of-result")):
            decode({"$": name}, {})
