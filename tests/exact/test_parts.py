"""Parts in executors: the same numbers, lost workers, folders taken up again."""

import os
import pickle
import signal
import subprocess
import sys
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from ball import BALL
from messages import message
from stumbles import again

import nsmaps
from nsmaps.exact.surfaces.along import Along
from nsmaps.exact.surfaces.sweep import sweep
from nsmaps.parallel import SERIAL, Arrays, Parallel


def square(x: float, note: str = "") -> Arrays:
    """A part that leaves a note of having been computed."""
    if note:
        with Path(note).open("a") as stream:
            stream.write(f"{x}\n")
    return {"square": np.array([x * x])}


def first_of(map_of: Along, value: float) -> Arrays:
    """The first return of one state at one value."""
    return {"image": map_of(value).first_return([[1.0, 0.5]]).image}


def dies_elsewhere(x: float, home: int) -> Arrays:
    """A part that kills its worker."""
    if os.getpid() != home and x == 2.0:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"square": np.array([x * x])}


@pytest.mark.parametrize("make", [None, lambda: ThreadPoolExecutor(2), lambda: ProcessPoolExecutor(2)])
def test_the_same_everywhere(make) -> None:
    parts = [(float(x),) for x in range(5)]
    shares: list[float] = []
    if make is None:
        found = Parallel(progress=shares.append).run(square, parts)
    else:
        with make() as executor:
            found = Parallel(executor, progress=shares.append).run(square, parts)
    assert [part["square"].item() for part in found] == [0.0, 1.0, 4.0, 9.0, 16.0]
    assert shares == [0.2, 0.4, 0.6, 0.8, 1.0]


def test_what_is_finished_is_kept_and_taken_up(tmp_path: Path) -> None:
    note, parts = tmp_path / "note", [(float(x),) for x in range(6)]
    parts = [(x, str(note)) for (x,) in parts]

    def stop(share: float) -> None:
        if share == 0.5:
            raise KeyboardInterrupt

    with pytest.raises(nsmaps.Interrupted) as stopped:
        Parallel(checkpoint=tmp_path / "kept", progress=stop).run(square, parts)
    assert {number: part["square"].item() for number, part in stopped.value.result.items()} == {0: 0.0, 1: 1.0, 2: 4.0}
    assert note.read_text().split() == ["0.0", "1.0", "2.0"]
    found = Parallel(checkpoint=tmp_path / "kept").run(square, parts)
    assert [part["square"].item() for part in found] == [0.0, 1.0, 4.0, 9.0, 16.0, 25.0]
    assert note.read_text().split() == ["0.0", "1.0", "2.0", "3.0", "4.0", "5.0"], "each once"
    with pytest.raises(nsmaps.NsmapsError, match=message("parallel.other-work")):
        Parallel(checkpoint=tmp_path / "kept").run(square, parts[:5])


def test_an_unfinished_file_is_no_part(tmp_path: Path) -> None:
    Parallel(checkpoint=tmp_path).run(square, [(1.0,), (2.0,)])
    (tmp_path / "part-000001.npz").rename(tmp_path / "part-000001.unfinished")
    assert Parallel(checkpoint=tmp_path).run(square, [(1.0,), (2.0,)])[1]["square"].item() == 4.0


def test_a_lost_worker_does_not_lose_the_sweep(tmp_path: Path) -> None:
    parts = [(float(x), os.getpid()) for x in range(6)]
    with ProcessPoolExecutor(2) as executor, pytest.warns(RuntimeWarning, match=message("parallel.workers-lost")):
        found = Parallel(executor, tmp_path).run(dies_elsewhere, parts)
    assert [part["square"].item() for part in found] == [0.0, 1.0, 4.0, 9.0, 16.0, 25.0]


def test_an_error_of_a_part_is_an_error() -> None:
    with ProcessPoolExecutor(1) as executor, pytest.raises(TypeError):
        Parallel(executor).run(square, [("x",)])


def test_what_cannot_be_sent_or_told_says_so(tmp_path: Path) -> None:
    with ProcessPoolExecutor(1) as executor, pytest.raises(nsmaps.NsmapsError, match=message("parallel.not-sent")):
        Parallel(executor).run(first_of, [(lambda d: d, 0.3)])
    with pytest.raises(nsmaps.NsmapsError, match=message("parallel.not-recognised")):
        Parallel(checkpoint=tmp_path).run(first_of, [(lambda d: d, 0.3)])


def test_a_system_of_a_file_reaches_a_fresh_process(tmp_path: Path) -> None:
    """Its module has a name that no other process could import."""
    (tmp_path / "mine.py").write_text(f"{BALL}\n# sent elsewhere\n")
    map_of = Along(nsmaps.load_system(f"{tmp_path / 'mine.py'}:Ball", a=0.9), "a")
    with (tmp_path / "sent").open("wb") as stream:
        pickle.dump((map_of, [0.9, 1.1]), stream)
    code = (
        "import pickle, sys; map_of, values = pickle.load(open(sys.argv[1], 'rb'));"
        "print([map_of(v).first_return([[1.0, 0.5]]).image.tolist() for v in values])"
    )
    run = subprocess.run([sys.executable, "-c", code, str(tmp_path / "sent")], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == str([map_of(v).first_return([[1.0, 0.5]]).image.tolist() for v in (0.9, 1.1)])


def test_the_note_tells_formulas_apart(tmp_path: Path) -> None:
    """An edited file is other work."""

    def kept() -> None:
        along = Along(nsmaps.load_system(f"{tmp_path / 'mine.py'}:Ball", a=0.9), "a")
        Parallel(checkpoint=tmp_path / "kept").run(first_of, [(along, 0.9)])

    (tmp_path / "mine.py").write_text(BALL)
    kept()
    (tmp_path / "mine.py").write_text(BALL.replace("s**2 / 2", "s**2 / 3.5"))
    with pytest.raises(nsmaps.NsmapsError, match=message("parallel.other-work")):
        kept()


@pytest.mark.thorough
@again
def test_dask_with_two_worker_processes(tmp_path: Path) -> None:
    """The same numbers as here, on the extra `cluster`; a worker that dies on the way is replaced."""
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    map_of = Along(nsmaps.load_system("vi_pair", d=0.3, g_bar=0.2113), "d")
    parts = [(map_of, float(d)) for d in np.linspace(0.26, 0.35, 8)]
    here = SERIAL.run(first_of, parts)
    workers = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True)
    with workers as cluster, distributed.Client(cluster) as client:
        client.wait_for_workers(2)
        pids = list(client.run(os.getpid).values())
        assert len({*pids, os.getpid()}) == 3

        def kill_one(share: float) -> None:
            if share == 2 / 8:
                os.kill(pids[0], signal.SIGKILL)

        there = Parallel(client.get_executor(pure=False), progress=kill_one).run(first_of, parts)
    assert all(np.array_equal(a["image"], b["image"]) for a, b in zip(here, there, strict=True))


def test_a_sweep_of_surfaces_in_processes_is_the_sweep_here(tmp_path: Path) -> None:
    system = nsmaps.load_system("vi_pair", d=0.3, g_bar=0.2113)
    grid = nsmaps.Grid(axes={"v": nsmaps.Axis(low=0.1, high=1.0, points=12), "phi": nsmaps.Axis(low=0.0, high=3.0, points=11)})
    families = [nsmaps.WordFamily(name="BTB", words=("BTB",)), nsmaps.WordFamily(name="BB", words=("BB",))]
    here = sweep(system, "d", [0.26, 0.3, 0.35], grid, families)
    with ProcessPoolExecutor(2) as executor:
        there = sweep(system, "d", [0.26, 0.3, 0.35], grid, families, parallel=Parallel(executor, tmp_path))
    again = sweep(system, "d", [0.26, 0.3, 0.35], grid, families, parallel=Parallel(checkpoint=tmp_path))
    for other in (there, again):
        for (a, one), (b, two) in zip(here, other, strict=True):
            assert a == b
            for name in one:
                assert np.array_equal(one[name].member, two[name].member)
                assert np.array_equal(one[name].image, two[name].image)
    with pytest.raises(nsmaps.NsmapsError, match=message("errors.unknown-near", kind="parameter", name="dd")):
        sweep(system, "dd", [0.3], grid, families)


def test_a_broken_part_or_note_loses_nothing_else(tmp_path: Path) -> None:
    tasks = [(k,) for k in range(4)]
    whole = Parallel(checkpoint=tmp_path).run(counted, tasks)
    for note in ("", '{"work'):
        (tmp_path / "parts.json").write_text(note)
        file = tmp_path / "part-000002.npz"
        file.write_bytes(file.read_bytes()[:50])
        COUNTED.clear()
        again = Parallel(checkpoint=tmp_path).run(counted, tasks)
        assert COUNTED == [2]
        assert [int(each["x"][0]) for each in again] == [int(each["x"][0]) for each in whole] == [0, 1, 2, 3]


def test_parts_of_other_work_are_not_taken_where_the_note_is_broken(tmp_path: Path) -> None:
    Parallel(checkpoint=tmp_path).run(counted, [(k,) for k in range(4)])
    (tmp_path / "parts.json").write_text("")
    COUNTED.clear()
    Parallel(checkpoint=tmp_path).run(counted, [(k + 1,) for k in range(4)])
    assert COUNTED == [1, 2, 3, 4]


COUNTED: list[int] = []


def counted(k: int) -> dict[str, np.ndarray]:
    """A part that notes that it was computed."""
    COUNTED.append(k)
    return {"x": np.array([k])}


def test_one_lost_part_leaves_the_others_to_their_workers(tmp_path: Path) -> None:
    class Losing(ThreadPoolExecutor):
        def submit(self, work, k):
            return super().submit(lost if k == 1 else work, k)

    def lost(k: int) -> None:
        raise BrokenExecutor("gone")

    COUNTED.clear()
    with (
        Losing(1) as executor,
        pytest.warns(RuntimeWarning, match=message("parallel.workers-lost", reason="gone", number=1, parts=4)),
    ):
        made = Parallel(executor).run(counted, [(k,) for k in range(4)])
    assert COUNTED == [0, 2, 3, 1]
    assert [int(each["x"][0]) for each in made] == [0, 1, 2, 3]


def test_what_is_no_executor_or_no_part_is_refused() -> None:
    with pytest.raises(nsmaps.NsmapsError, match=message("parallel.executor", type="int")):
        Parallel(2)
    with pytest.raises(nsmaps.NsmapsError, match=message("parallel.items", number=0)):
        Parallel(part=0)


def test_the_items_of_parts_and_a_portion_with_a_folder_of_its_own(tmp_path: Path) -> None:
    assert SERIAL.cuts(5, 2) == [slice(0, 2), slice(2, 4), slice(4, 5)]
    assert Parallel(part=3).cuts(5, 2) == [slice(0, 3), slice(3, 5)]
    shares: list[float] = []
    portion = Parallel(checkpoint=tmp_path, progress=shares.append).share(0.5, 1.0, "second")
    portion.run(square, [(1.0,), (2.0,)])
    assert shares == [0.75, 1.0]
    assert len(list((tmp_path / "second").glob("part-*.npz"))) == 2


def long_part(x: float) -> Arrays:
    """A part in which other long calls report their own progress."""
    nsmaps.orbit(nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113), [0.8, 0.4], 3)
    return {"square": np.array([x * x])}


def test_calls_within_a_part_do_not_report_as_the_whole() -> None:
    shares: list[float] = []
    Parallel(progress=shares.append).run(long_part, [(1.0,), (2.0,)])
    assert shares == [0.5, 1.0]
