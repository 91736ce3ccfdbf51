"""Whatever stops a program or a disk: the next run goes on, and nothing that was finished is lost.

`python -m pytest -m thorough tests/test_reliability.py -n 0 -s` does each ten times, or as often as the environment's TIMES says.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from ball import BALL

from nsmaps import parallel as parts
from nsmaps import read_result

TIMES = int(os.environ.get("TIMES", 10))
STUDY = """\
system: ball.py:Ball
parameters: {a: 0.2}
bifurcation_diagram: {parameter: a, from: 0.2, to: 0.4, points: 40, starts: [{v: 0.3, phi: 1}], n_returns: 50, transient: 1000}
grid: {v: {from: 0.01, to: 0.5, points: 81}, phi: {from: 0, to: 2*pi, points: 81}}
families: {low: [BB]}
orbits: [{start: {v: 0.3, phi: 1}, n_returns: 20000}]
"""
linux = pytest.mark.skipif(not sys.platform.startswith("linux") or not shutil.which("unshare"), reason="mounts as Linux has them")


@pytest.fixture
def work(tmp_path: Path) -> Path:
    """A folder with a system of its own and a little study of it."""
    (tmp_path / "ball.py").write_text(BALL)
    (tmp_path / "s.yaml").write_text(STUDY)
    return tmp_path


def started(work: Path, *words: str, cache: str = "kernels", within: str = "") -> "subprocess.Popen[str]":
    """A program that runs the study, by `"$@"` of a shell's script that may mount what only it sees."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "NSMAPS_CACHE_DIR": str(work / cache)}
    command = [sys.executable, "-m", "nsmaps", "run", "s.yaml", "--out", "out", "--no-figures", "--no-report", "-q", *words]
    if within:
        own = ["unshare", "--mount"] if os.getuid() == 0 else ["unshare", "--user", "--map-root-user", "--mount"]
        command = [*own, "sh", "-c", within, "sh", *command]
    return subprocess.Popen(command, cwd=work, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def done(work: Path, *words: str, **how: str) -> tuple[int, str]:
    """The exit code of a run and what it says of errors."""
    program = started(work, *words, **how)
    _, told = program.communicate(timeout=300)
    return program.returncode, told


def numbers(folder: Path) -> dict[str, np.ndarray]:
    with np.load(folder / "arrays.npz", allow_pickle=False) as arrays:
        return dict(arrays)


def assert_same(folder: Path, whole: dict[str, np.ndarray]) -> None:
    """The folder holds a finished run with these numbers, and no remains of another."""
    assert read_result(folder).finished
    found = numbers(folder)
    assert found.keys() == whole.keys()
    assert all(np.array_equal(found[name], value, equal_nan=value.dtype.kind == "f") for name, value in whole.items())
    assert not (folder / "parts").exists()
    assert not (folder / ".ready").exists()


@pytest.fixture
def whole(work: Path) -> dict[str, np.ndarray]:
    """The numbers of a run that nothing stops; kernels are compiled by it."""
    assert done(work) == (0, "")
    made = numbers(work / "out")
    shutil.rmtree(work / "out")
    return made


def finished(folder: Path) -> set[str]:
    """The files of finished steps and parts."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*.npz") if not path.name.startswith(".")}


def tell(what: str, count: int) -> None:
    print(f"\n{what}: {count} of {TIMES}")


@pytest.mark.thorough
def test_killed_at_any_moment(work: Path, whole: dict[str, np.ndarray]) -> None:
    begun = time.perf_counter()
    assert done(work)[0] == 0
    took = time.perf_counter() - begun
    rng, stopped = np.random.default_rng(0), 0
    for _ in range(TIMES):
        shutil.rmtree(work / "out")
        before: set[str] = set()
        for wait in rng.uniform(0.3, 1.0, 3) * took:
            program = started(work, "--resume")
            time.sleep(wait)
            program.send_signal(signal.SIGKILL)
            program.communicate()
            stopped += program.returncode == -signal.SIGKILL
            kept = finished(work / "out") if (work / "out").exists() else set()
            assert before <= kept or "arrays.npz" in kept
            before = kept
        assert done(work, "--resume") == (0, "")
        assert_same(work / "out", whole)
    tell(f"killed at {3 * TIMES} moments ({stopped} before the end)", TIMES)


@linux
@pytest.mark.thorough
def test_full_disk(work: Path, whole: dict[str, np.ndarray]) -> None:
    """The run ends in a line; with more room it goes on, and what was finished is there."""
    (work / "out").mkdir()
    size = sum(value.nbytes for value in whole.values()) // 1024
    for room in np.linspace(0.05, 1.2, TIMES) * size:  # a run needs 1.3 of it, for a short time
        more = f'mount -o remount,size={8 * size}k out; ls out/parts >&2; "$@" --resume && cp -r out saved'
        code, told = done(work, within=f'mount -t tmpfs -o size={int(room)}k tmpfs out; "$@"; echo $? >&2; {more}')
        assert code == 0, told
        first, *_ = told.splitlines()
        assert "No space left on device" in first
        assert "Traceback" not in told
        assert_same(work / "saved", whole)
        shutil.rmtree(work / "saved")
    tell("full disk", TIMES)


@linux
@pytest.mark.thorough
def test_full_disk_of_kernels(work: Path) -> None:
    (work / "kernels").mkdir()
    for room in np.linspace(16, 400, TIMES).astype(int):
        code, told = done(work, within=f'mount -t tmpfs -o size={room}k tmpfs kernels; "$@"')
        assert code == 0, told
        assert told.count("compiled code cannot be kept in") == 1
    tell("full disk of kernels", TIMES)


@linux
@pytest.mark.thorough
def test_read_only_disk(work: Path, whole: dict[str, np.ndarray]) -> None:
    assert done(work)[0] == 0
    for k in range(TIMES):
        only = "mount --bind out out; mount -o remount,ro,bind out"
        code, told = done(work, *(["--resume"] if k % 2 else []), within=only + '; "$@"')
        assert (code, told.count("\n")) == (2, 1)
        assert told.startswith("out is not a writable folder")
        kernels = "mount --bind kernels kernels; mount -o remount,ro,bind kernels"
        assert done(work, within=kernels + '; "$@"') == (0, "")
        assert_same(work / "out", whole)
    tell("read-only disk", TIMES)


@pytest.mark.thorough
def test_broken_cache(work: Path, whole: dict[str, np.ndarray]) -> None:
    rng, cache = np.random.default_rng(1), work / "kernels"
    for k in range(TIMES):
        for file in sorted(cache.iterdir())[k % 3 :: 3]:
            content = bytearray(file.read_bytes())
            content[int(rng.integers(len(content)))] ^= 255
            file.write_bytes(content[: rng.integers(len(content))] if rng.random() < 0.5 else content)
        assert done(work)[0] == 0
        assert_same(work / "out", whole)
    tell("broken cache", TIMES)


@pytest.mark.thorough
@pytest.mark.parametrize("file", ["study.yaml", "result.json", "arrays.npz"])
def test_broken_folder(work: Path, whole: dict[str, np.ndarray], file: str) -> None:
    assert done(work)[0] == 0
    for k in range(TIMES):
        path = work / "out" / file
        content = path.read_bytes()
        path.write_bytes(content[: len(content) * k // TIMES])
        code, told = done(work, "--resume")
        assert (code, told.count("\n")) == (0, 1)
        assert f"out/{file} cannot be read" in told
        assert_same(work / "out", whole)
    tell(f"broken {file}", TIMES)


@pytest.mark.thorough
def test_two_first_runs_at_once(work: Path) -> None:
    made = []
    for k in range(TIMES):
        programs = [started(work, "--out", f"out{k}{i}", cache=f"cache{k}") for i in (0, 1)]
        assert [program.communicate()[1] for program in programs] == ["", ""]
        assert [program.returncode for program in programs] == [0, 0]
        made += [numbers(work / f"out{k}{i}") for i in (0, 1)]
        assert done(work, "--out", f"out{k}0", cache=f"cache{k}") == (0, "")
    for each in made:
        assert all(np.array_equal(each[name], value, equal_nan=value.dtype.kind == "f") for name, value in made[0].items())
    tell("two first runs at once", TIMES)


def _work(number: int, folder: str, dies: bool) -> dict[str, np.ndarray]:
    """A part; one of them takes its process with it, the first time."""
    flag = Path(folder, f"died{number}")
    if dies and not flag.exists():
        flag.write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    return {"square": np.array([number**2])}


@pytest.fixture
def cluster() -> Iterator[object]:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as made,
        distributed.Client(made) as client,
    ):
        yield client


@pytest.mark.thorough
def test_lost_workers_of_processes(tmp_path: Path) -> None:
    for k in range(TIMES):
        tasks = [(number, str(tmp_path), number == k % 4) for number in range(8)]
        with ProcessPoolExecutor(2) as executor, warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            made = parts.Parallel(executor, tmp_path / f"keep{k}").run(_work, tasks)
        assert [int(each["square"][0]) for each in made] == [number**2 for number in range(8)]
        assert len(list((tmp_path / f"keep{k}").glob("part-*.npz"))) == 8
        (tmp_path / f"died{k % 4}").unlink()
    tell("lost process", TIMES)


@pytest.mark.thorough
def test_lost_workers_of_dask(tmp_path: Path, cluster) -> None:
    for k in range(TIMES):
        tasks = [(number, str(tmp_path), number == k % 4) for number in range(8)]
        made = parts.Parallel(cluster.get_executor(), tmp_path / f"keep{k}").run(_work, tasks)
        assert [int(each["square"][0]) for each in made] == [number**2 for number in range(8)]
        (tmp_path / f"died{k % 4}").unlink()
    tell("lost dask worker", TIMES)
