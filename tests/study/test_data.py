"""Results as xarray: names, dimensions, units, and that nothing is lost on the way through a file."""

import sys
from pathlib import Path

import numpy as np
import pytest
from messages import message

import nsmaps

xarray = pytest.importorskip("xarray")
ANGLE = "rad"


@pytest.fixture(scope="module")
def system() -> nsmaps.ImpactSystem:
    """The pair of case FP."""
    return nsmaps.load_system("vi_pair", d=0.35, r=0.5, g_bar=0.21132751903147873)


STATES = np.array([[0.43, 0.26], [0.2, 0.1], [np.nan, 1.0]])


def test_returns(system: nsmaps.ImpactSystem) -> None:
    made = system.first_return(STATES, derivative=True)
    data = made.to_xarray()
    assert data.image.dims == ("state", "coordinate")
    assert data.derivative.dims == ("state", "coordinate", "by")
    assert data.coordinate.values.tolist() == data.by.values.tolist() == ["v", "phi"]
    assert data.unit.values.tolist() == ["1", ANGLE]
    assert np.array_equal(data.image.sel(coordinate="phi"), made.image[:, 1], equal_nan=True)
    assert np.array_equal(data.derivative.sel(coordinate="v", by="phi"), made.derivative[:, 0, 1], equal_nan=True)
    assert data.words.values.tolist() == made.words.tolist()
    assert data.outcome.values.tolist() == [0, 0, 6]
    assert data.outcome.attrs["long_name"].startswith("0 returned; 1 stuck; ")
    assert data.attrs == {"fitted": 0, "integrated": 0}
    assert all({"units", "long_name"} <= set(array.attrs) for array in data.data_vars.values())


def test_orbits_of_one_start_and_of_several(system: nsmaps.ImpactSystem) -> None:
    one = nsmaps.orbit(system, [0.2, 0.1], 4)
    several = nsmaps.orbit(system, [[0.2, 0.1], [0.43, 0.26], [0.8, 0.3]], 4)
    data, more = one.to_xarray(), several.to_xarray()
    assert dict(data.sizes) == {"step": 5, "coordinate": 2, "return": 4}
    assert dict(more.states.sizes) == {"step": 5, "start": 3, "coordinate": 2}
    assert np.array_equal(data.states.isel(step=4), one.final)
    assert np.array_equal(more.states.isel(start=0), data.states)
    assert data.words.isel({"return": 0}) == one.words[0]


def test_a_bifurcation_diagram(system: nsmaps.ImpactSystem) -> None:
    made = nsmaps.bifurcation_diagram(system, "d", [0.3, 0.35], [0.8, 0.3], n_returns=6, transient=50)
    data = made.to_xarray()
    assert dict(data.states.sizes) == {"d": 2, "start": 1, "return": 6, "coordinate": 2}
    assert data.labels.sel(d=0.35).values.tolist() == made.labels[1].tolist()


def test_an_attracting_domain(system: nsmaps.ImpactSystem) -> None:
    made = nsmaps.attracting_domain(system, [[0.7, 1.0], [0.2, 1.14]], max_updates=3, n_samples=31)
    data = made.to_xarray()
    assert dict(data.sizes) == {"update": 4, "coordinate": 2, "end": 2}
    assert np.array_equal(data.boxes.sel(update=3, coordinate="phi"), made.box[1])
    assert (data.attrs["forward_invariant"], data.attrs["of"]) == (1, "exact map")


def test_a_whole_result_comes_back_from_netcdf(good: str) -> None:
    pytest.importorskip("h5netcdf")
    pytest.importorskip("h5py")
    Path("s.yaml").write_text(good.replace("low: [BB]", '"low/all": [BB]').replace("family: low", "family: low/all"))
    result = nsmaps.run_study("s.yaml")
    tree = result.to_xarray()
    assert {"/returns", "/surfaces/low|all", "/orbits/0/exact", "/orbits/0/composite", "/domains/exact"} <= set(tree.groups)
    assert tree.attrs == {"study": "s", "title": "The ball", "system": "ball", "a": 0.2, "r": 0.5}
    tree.to_netcdf("all.nc", engine="h5netcdf")
    with xarray.open_datatree("all.nc", engine="h5netcdf") as again:
        assert again.identical(tree)
        assert np.array_equal(again["returns"]["image"], result.returns.image, equal_nan=True)


STORED = Path(__file__).parents[1] / "data" / "run-format-4"


@pytest.mark.parametrize("name", ["run", "partition", "accurate", "long"])
def test_every_array_of_a_run_is_in_its_tree_and_in_netcdf(name: str) -> None:
    """But for words, which are kept as codes."""
    pytest.importorskip("h5netcdf")
    h5py = pytest.importorskip("h5py")
    tree = nsmaps.read_result(STORED / name).to_xarray()
    found = {content(array.values) for node in tree.subtree for array in node.variables.values()}
    with np.load(STORED / name / "arrays.npz", allow_pickle=False) as arrays:
        lost = [path.split("/") for path in arrays.files if content(arrays[path]) not in found]
        assert len(arrays.files) > 25
    assert [path for path in lost if path[-1] != "codes"] == []
    tree.to_netcdf("all.nc", engine="h5netcdf")
    with h5py.File("all.nc") as written:
        for node in tree.subtree:
            for array in node.data_vars.values():
                assert written[f"{node.path}/{array.name}"].shape == array.shape


def content(array: np.ndarray) -> tuple[tuple[int, ...], bytes]:
    """What an array holds, a complex number as two."""
    plain = np.stack([array.real, array.imag], axis=-1) if np.iscomplexobj(array) else array
    return plain.shape, np.ascontiguousarray(plain).tobytes()


def test_axes_have_names() -> None:
    tree = nsmaps.read_result(STORED / "long").to_xarray()
    assert tree["parameter_plane/period"].dims == ("r", "d", "start")
    assert tree["basins/label"].dims == ("state",)
    assert tree["basins/attractors/0"].attrs["period"] == 1
    assert tree["orbits/0/ends/multipliers"].dims == ("multiplier", "part")
    assert tree["composite/pieces/0/map/report/r2"].sel(coordinate="phi").ndim == 0


def test_without_xarray_the_error_says_what_to_install(system: nsmaps.ImpactSystem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(nsmaps.NsmapsError, match=message("results.no-xarray")):
        system.first_return([[0.2, 0.1]]).to_xarray()
