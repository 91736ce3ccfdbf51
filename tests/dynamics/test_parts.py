"""Sweeps in parts: in two processes and out of folders the numbers are those of one process, and nothing is computed twice."""

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from messages import message
from stumbles import again

import nsmaps
from nsmaps.dynamics.attractors import basins
from nsmaps.dynamics.attractors.basins import find_attractors
from nsmaps.dynamics.diagrams import parts
from nsmaps.dynamics.lyapunov import lyapunov
from nsmaps.dynamics.noise.impacts import impact_diagram
from nsmaps.dynamics.planes import parameter_plane
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.sweep import sweep

PAIR = nsmaps.load_system("vi_pair", d=0.3, g_bar=0.2113275192854541)
BISTABLE = nsmaps.load_system("vi_pair", d=0.2265, r=0.25, M=0.1245, g=9.8, beta=np.pi / 6, F=5)
ALONG = nsmaps.exact.Along(PAIR, "d")
VALUES = [0.30, 0.26, -1.0, 0.35, 0.28]  # at -1 there is no map
STARTS = [[0.8, 0.4], [0.7, 0.3], [0.2, 3.0]]
PLANE = {"d": nsmaps.Axis(low=0.25, high=0.35, points=6), "r": [0.4, 0.5, 0.6, 1.5]}  # at r = 1.5 there is no map
NOISE = nsmaps.Noise(sigma=0.03, tau=0.5)
DIAGRAM = partial(nsmaps.bifurcation_diagram, PAIR, "d", VALUES, STARTS, n_returns=20, transient=100)
SWEEPS: dict[str, Callable[..., Any]] = {
    **{f"bifurcation {way}": partial(DIAGRAM, direction=way) for way in (None, "up", "down", "both")},
    "lyapunov": partial(lyapunov, PAIR, "d", VALUES, [0.8, 0.4], n_returns=64, transient=50),
    "lyapunov up": partial(lyapunov, PAIR, "d", VALUES, [0.8, 0.4], n_returns=64, transient=50, direction="up"),
    "basins": partial(nsmaps.basins, BISTABLE, np.random.default_rng(0).uniform([0.1, 0], [1, 6], (70, 2)), max_returns=300),
    "noise": partial(nsmaps.noisy_orbits, PAIR, [0.8, 0.4], NOISE, n_returns=10, n_realisations=20, rng=4, max_impacts=5),
    **{
        f"plane {way}": partial(
            nsmaps.parameter_plane, PAIR, PLANE, STARTS[:2], n_returns=20, transient=100, max_period=8, direction=way
        )
        for way in (None, "up", "both")
    },
    "plane refined": partial(
        nsmaps.parameter_plane, PAIR, PLANE, STARTS[:1], n_returns=20, transient=100, max_period=8, refine=4, observables=["loss"]
    ),
    "impacts": partial(impact_diagram, PAIR, "d", [0.3, 0.35], [0.8, 0.4], NOISE, "up", 5, 10),
}


@pytest.fixture(scope="module")
def two() -> Iterator[Executor]:
    """Two processes."""
    with ProcessPoolExecutor(2) as executor:
        yield executor


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of two values or fewer, and of thirty starts."""
    monkeypatch.setattr(parts, "PART", 200)
    monkeypatch.setattr(parameter_plane, "PART", 1200)
    monkeypatch.setattr(basins, "CHUNK", 30)


def numbers(result: Any) -> list[Any]:
    """Everything a result holds, arrays as bytes, so that NaN is NaN and types count."""
    if is_dataclass(result):
        return [numbers(getattr(result, field.name)) for field in fields(result)]
    if isinstance(result, tuple):
        return [type(result), *map(numbers, result)]
    return [type(result), (result.dtype, result.shape, result.tobytes()) if isinstance(result, np.ndarray) else result]


@pytest.mark.parametrize("name", SWEEPS)
def test_two_processes_and_a_folder_have_the_numbers_of_one(name: str, two: Executor, tmp_path: Path) -> None:
    here = numbers(SWEEPS[name]())
    assert numbers(SWEEPS[name](parallel=nsmaps.Parallel(two, tmp_path))) == here
    files = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*.npz")}
    assert len(files) == {"lyapunov up": 1, "impacts": 1}.get(name, len(files))
    assert len(files) > 1 or name in ("lyapunov up", "impacts")
    assert numbers(SWEEPS[name](parallel=nsmaps.Parallel(checkpoint=tmp_path))) == here
    assert {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*.npz")} == files, "nothing is written again"


@dataclass(frozen=True)
class Noted:
    """x -> a x (1 - x), and a note of each value at which the map was made."""

    note: Path

    def __call__(self, a: float) -> "Logistic":
        with self.note.open("a") as stream:
            stream.write(f"{a}\n")
        return Logistic(a)


@dataclass(frozen=True)
class Logistic(ReturnMap):
    """x -> a x (1 - x)."""

    a: float
    coordinates: tuple[str, ...] = ("x",)

    def first_return(self, states: Any, derivative: bool = False) -> Returns:
        """One step, the word always BB."""
        x = np.asarray(states, float)
        n = len(x)
        none = np.zeros((n, 1), np.int32), np.full(n, 6), np.zeros(n, np.int8), np.full(n, np.nan)
        return Returns(self.coordinates, ("B",), x, self.a * x * (1 - x), *none)


@pytest.mark.parametrize("follow", [None, "up"])
def test_a_stopped_diagram_goes_on_at_what_is_missing(tmp_path: Path, follow: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts are two values of two starts apart, or four values of one start followed; all orbits have a period."""
    monkeypatch.setattr(parts, "PART", 1280)
    values, starts = [2.8, 3.2, 3.5, 3.55, 3.1, 3.832, 2.9], [[0.3], [0.4]]
    run = partial(
        nsmaps.bifurcation_diagram, Noted(tmp_path / "note"), "p", values, starts, n_returns=20, transient=300, direction=follow
    )
    whole = run()
    (tmp_path / "note").unlink()

    def stop(share: float) -> None:
        if share >= 2 / 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(parallel=nsmaps.Parallel(checkpoint=tmp_path / "kept", progress=stop))
    before = (tmp_path / "note").read_text().split()
    shares: list[float] = []
    again = run(parallel=nsmaps.Parallel(checkpoint=tmp_path / "kept", progress=shares.append))
    after = (tmp_path / "note").read_text().split()[len(before) :]
    once = sorted(map(str, values)) if follow is None else sorted(map(str, values * 2))
    assert sorted(before + after) == once, "each value of each part once"
    assert before
    assert after
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert numbers(again) == numbers(whole)
    with pytest.raises(NsmapsError, match=message("parallel.other-work")):
        nsmaps.bifurcation_diagram(
            Noted(tmp_path / "note"),
            "p",
            values,
            starts,
            n_returns=20,
            transient=301,
            direction=follow,
            parallel=nsmaps.Parallel(checkpoint=tmp_path / "kept"),
        )


@pytest.mark.parametrize("name", SWEEPS)
def test_a_part_of_any_size_has_the_same_numbers(name: str, tmp_path: Path) -> None:
    here = numbers(SWEEPS[name]())
    shares: list[float] = []
    made = SWEEPS[name](parallel=nsmaps.Parallel(checkpoint=tmp_path, part=3, progress=shares.append))
    assert numbers(made) == here
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert min(shares) >= 0


def stopped(run: Callable[..., Any], after: int = 2) -> Any:
    """The result of a call that Ctrl-C stops when some parts are finished."""
    reports: list[float] = []

    def stop(share: float) -> None:
        reports.append(share)
        if len(reports) == after:
            raise KeyboardInterrupt

    with ThreadPoolExecutor(1) as executor, pytest.raises(nsmaps.Interrupted) as interrupted:
        run(parallel=nsmaps.Parallel(executor, progress=stop))
    return interrupted.value.result


def test_of_interrupted_basins_other_starts_have_reached_none() -> None:
    starts = np.random.default_rng(2).uniform([0.1, 0], [1, 6], (80, 2))
    whole = nsmaps.basins(BISTABLE, starts, max_returns=300)
    known = tuple(whole.attractors)
    result = stopped(partial(nsmaps.basins, BISTABLE, starts, attractors=known, max_returns=300))
    assert isinstance(result, nsmaps.dynamics.Basins)
    assert result.label[:60].tolist() == whole.label[:60].tolist()
    assert result.arrival[:60].tolist() == whole.arrival[:60].tolist()
    assert result.label[60:].tolist() == [-1] * 20
    assert result.arrival[60:].tolist() == [0] * 20


def test_basins_that_are_not_divided_are_interrupted_with_what_has_arrived() -> None:
    starts = np.random.default_rng(2).uniform([0.1, 0], [1, 6], (80, 2))
    whole = nsmaps.basins(BISTABLE, starts, max_returns=300)

    def stop(share: float) -> None:
        if share > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(nsmaps.Interrupted) as interrupted:
        nsmaps.basins(BISTABLE, starts, attractors=whole.attractors, max_returns=300, parallel=nsmaps.Parallel(progress=stop))
    result = interrupted.value.result
    arrived = result.label >= 0
    assert 0 < arrived.sum() < (whole.label >= 0).sum()
    assert result.label[arrived].tolist() == whole.label[arrived].tolist()
    assert result.arrival[arrived].max() <= result.arrival[~arrived].min()


def test_of_interrupted_noise_and_batches_there_are_the_first() -> None:
    noise = partial(nsmaps.noisy_orbits, PAIR, [0.8, 0.4], NOISE, n_returns=10, rng=4, max_impacts=5)
    assert numbers(stopped(partial(noise, n_realisations=20))) == numbers(noise(n_realisations=16))
    starts = np.random.default_rng(3).uniform([0.1, 0], [1, 6], (7, 2))
    batch = partial(PAIR.orbits, n_returns=3)

    def run(parallel: nsmaps.Parallel) -> Returns:
        return batch(starts, parallel=replace(parallel, part=2))

    assert numbers(stopped(run)) == numbers(batch(starts[:4]))


def test_of_interrupted_surfaces_and_means_there_are_the_values_that_are_finished() -> None:
    grid = nsmaps.Grid(axes={"v": nsmaps.Axis(low=0.2, high=0.8, points=3), "phi": nsmaps.Axis(low=0, high=6, points=4)})
    surfaces = partial(sweep, PAIR, "d", [0.26, 0.3, 0.35], grid, [nsmaps.WordFamily(name="one", words=["BTB"])])
    result, whole = stopped(surfaces), surfaces()
    assert [value for value, _ in result] == [0.26, 0.3]
    assert [numbers(found["one"].returns) for _, found in result] == [numbers(found["one"].returns) for _, found in whole[:2]]
    diagram = nsmaps.bifurcation_diagram(PAIR, "d", [0.3, 0.33, 0.35], [0.8, 0.4], n_returns=8, transient=100)
    means = partial(nsmaps.observe, ALONG, diagram, ["loss"], n_returns=20)
    result, whole = stopped(means), means()
    assert np.isnan(result.per_return.value[2]).all()
    assert result.per_return.value[:2].tolist() == whole.per_return.value[:2].tolist()


def test_labels_do_not_depend_on_chunks() -> None:
    """They are those of each start alone."""
    starts = np.random.default_rng(1).uniform([0.1, 0], [1, 6], (35, 2))
    known = find_attractors(BISTABLE, starts[:20], 300)
    alone = [nsmaps.basins(BISTABLE, start[None], attractors=known, max_returns=300).label.item() for start in starts]
    with ThreadPoolExecutor(1) as executor:
        assert (
            nsmaps.basins(BISTABLE, starts, attractors=known, max_returns=300, parallel=nsmaps.Parallel(executor)).label.tolist()
            == alone
        )


@pytest.mark.thorough
@again
def test_a_diagram_on_dask_survives_a_lost_worker(tmp_path: Path) -> None:
    """Two worker processes, of which one is killed after the second part."""
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    workers = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True)
    with workers as cluster, distributed.Client(cluster) as client:
        client.wait_for_workers(2)
        pid, other = client.run(os.getpid).values()
        shares: list[float] = []

        def kill_one(share: float) -> None:
            shares.append(share)
            if len(shares) == 2:
                os.kill(pid, signal.SIGKILL)

        there = DIAGRAM(parallel=nsmaps.Parallel(client.get_executor(pure=False), tmp_path, progress=kill_one))
        assert len({pid, other, os.getpid()}) == 3
    assert shares == sorted(shares)
    assert (len(shares) > 2, shares[-1]) == (True, 1.0)
    assert numbers(there) == numbers(DIAGRAM())


def test_two_parameters_need_two_values() -> None:
    with pytest.raises(TypeError, match=message("exact.along", number=1, names="d and r", count=2)):
        nsmaps.exact.Along(PAIR, "d", "r")(0.3)
