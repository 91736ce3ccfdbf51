"""The benchmark: its references and the C loops agree with nsmaps, its table says what it should."""

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
import pytest
from cloop import CLoop
from messages import message

import nsmaps.bench
from nsmaps.bench.comparison import errors
from nsmaps.bench.count import work_per_return
from nsmaps.bench.programs.ours import OneCore
from nsmaps.bench.task import GRID, Answer, Floats, Pair, grid, grid_task, hard_tasks
from nsmaps.errors import NsmapsError

DATA = Path(__file__).parents[1] / "data"
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


@dataclass(frozen=True)
class Careless(nsmaps.bench.Solver):
    """Gives the true answers of the task, but for some of the first."""

    wrong_words: int = 0
    off: float = 0.0
    family = "careless"
    setting = ""

    def prepare(self) -> str:
        return "careless 1"

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        tasks = [task for task in (grid_task(), *hard_tasks()) if task.pair == pair]
        found = next(task.first(len(starts)).truth for task in tasks if (task.first(len(starts)).starts == starts).all())
        answer = Answer(found.image + np.array([0.0, self.off]), found.tops.copy())
        answer.tops[: self.wrong_words] += 1
        return lambda: answer


@dataclass(frozen=True)
class Absent(Careless):
    """Cannot take part."""

    family = "absent"

    def prepare(self) -> str:
        raise ImportError("No module named 'absent'")


def test_references_agree_with_nsmaps() -> None:
    task = grid_task()
    assert errors(OneCore().solve(task.pair, task.starts)(), task.truth).max() < 1e-12


def test_the_sample_is_the_grid() -> None:
    starts = grid_task().starts
    assert sorted(map(tuple, starts)) == sorted(map(tuple, grid()))
    assert starts[:, 0].min() == 0.01
    assert starts[:, 0].max() == 1.2
    assert 0 <= starts[:, 1].min() <= starts[:, 1].max() < 2 * pi


def test_the_pair_is_that_of_the_tests(pair: Callable[..., object]) -> None:
    system = pair(GRID.d)
    assert (system.d, system.r, system.g_bar) == (GRID.d, GRID.r, GRID.g_bar)


def test_the_hard_cases_are_those_of_the_tests() -> None:
    rows = json.loads((DATA / "hard_returns.json").read_text())["rows"]
    expected = {(q["d"], q["v"], q["phi"]): (float(q["v1"]), float(q["phi1"]), q["word"].count("T")) for q in rows}
    kept = {
        (task.pair.d, *map(float, start)): (*map(float, image), int(tops))
        for task in hard_tasks()
        for start, image, tops in zip(task.starts, task.truth.image, task.truth.tops, strict=True)
    }
    assert kept == expected


@needs_gcc
@pytest.mark.parametrize("tuned", [False, True])
@pytest.mark.parametrize("d", [0.26, 0.35])
def test_the_c_loops_agree_with_nsmaps(tuned: bool, d: float) -> None:
    rng = np.random.default_rng(5)
    starts = np.column_stack([rng.uniform(1e-3, 1.5, 300), rng.uniform(0, 2 * pi, 300)])
    pair = Pair(d, 0.5, GRID.g_bar)
    ours, loop = (program.solve(pair, starts)() for program in (OneCore(), CLoop(tuned)))
    plain = ours.tops >= 0  # some chatter on T, which the loop does not sum up
    off = errors(loop, ours)[plain]
    assert plain.sum() > 280
    assert (loop.tops[~plain] == -1).all()
    assert np.median(off) < 1e-14
    assert off.max() < 1e-10


@pytest.mark.parametrize("program", nsmaps.bench.programs(), ids=lambda program: program.name)
def test_a_program_finds_ordinary_returns(program: nsmaps.bench.Solver) -> None:
    try:
        program.prepare()
    except ImportError as why:
        pytest.skip(f"not installed: {why}")
    task = grid_task().first(12)
    off = errors(program.solve(task.pair, task.starts)(), task.truth)
    assert np.median(off) < 1e-3


@needs_gcc
def test_a_small_race(tmp_path: Path) -> None:
    result = nsmaps.bench.run([OneCore(), CLoop(), Absent()], n_returns=300, n_rounds=2)
    assert [row.name for row in result.rows] == ["nsmaps one core", "C loop plain"]
    assert [(row.wrong, row.wrong_hard) for row in result.rows] == [(0, 0), (0, 0)]
    assert all(row.worst < 1e-12 for row in result.rows)
    assert result.against == "C loop plain"
    assert result.ratio("C loop plain") == 1
    table = result.table()
    for column in ("program", "µs per return", "time / C loop plain", "worst error", "99 % error", "wrong words", "60 hard"):
        assert column in table.splitlines()[0]
    widths = {line.count("|") for line in table.splitlines() if line.startswith("|")}
    assert widths == {9}
    for told in ("absent (No module named 'absent')", "Python 3", "gcc ", "its own expert may do better", "evaluations"):
        assert told in table
    assert nsmaps.bench.figure(result, tmp_path / "deep" / "bench.png").read_bytes()[:4] == b"\x89PNG"


def test_wrong_words_and_errors_are_seen() -> None:
    row = nsmaps.bench.run([Careless(wrong_words=3, off=2 * pi + 1e-6)], n_returns=200, n_rounds=1).row("careless")
    assert row.wrong == 3
    assert row.wrong_hard == 3 * len(hard_tasks())
    assert row.worst == pytest.approx(1e-6, rel=1e-6)
    assert row.asked == 200


def test_no_answer_is_a_wrong_word() -> None:
    task = grid_task().first(4)
    assert (errors(Answer.none(4), task.truth) == np.inf).all()


def test_what_cannot_be_run_is_refused() -> None:
    with pytest.raises(NsmapsError, match=message("bench.no-solver", name="absent", reason="No module named 'absent'")):
        nsmaps.bench.run([Absent()])
    with pytest.raises(NsmapsError, match=message("bench.not-available", name="carless", near="careless")):
        nsmaps.bench.run([Careless()], against="carless")
    with pytest.raises(NsmapsError, match=message("bench.returns", number=0)):
        nsmaps.bench.run([Careless()], n_returns=0)


def test_work_is_counted() -> None:
    work = work_per_return(20)
    assert 1 <= work["evaluations of a flight"] <= 12
    assert work["of sine and cosine"] >= work["evaluations of a flight"]
