"""Ctrl-C ends compiled loops before they are done, also in threads, and a run with its workers."""

import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor
from pathlib import Path
from time import sleep
from typing import Any

import numpy as np
import pytest
import typer

import nsmaps
from nsmaps import Noise, Observable, noisy_orbits
from nsmaps.cli.workers import processes, resumable
from nsmaps.exact.engine import kernel
from nsmaps.exact.noise import modes
from nsmaps.exact.observables import totals
from nsmaps.exact.observables.formulas import plan_of
from nsmaps.study.store.run_folder import PARTS

BELT = nsmaps.load_system("belt", zeta=0.02, vb=0.3, mu_k=0.4, mu_s=0.6, w=0.9, A=0.25)
PAIR = nsmaps.load_system("vi_pair", d=0.35, r=0.5, g_bar=0.2113)
STARTS = {BELT: [0.838, 0.0], PAIR: [0.83, 0.36]}
FORCE = (Observable(name="force", formula="cos(phi)", of="flights"),)
MANY = 5_000_000  #: returns, which take much longer than until Ctrl-C


def summed(system: Any, states: int, returns: int) -> Any:
    return totals.totals_of(system, plan_of(system, FORCE), np.tile(STARTS[system], (states, 1)), returns)


def slopes(states: int) -> Any:
    start, rates = np.tile(STARTS[BELT], (states, 1)), np.ones(len(BELT.parameters))
    return totals.slopes_of(BELT, plan_of(BELT, FORCE), start, rates)


def noisy(returns: int, realisations: int) -> Any:
    return noisy_orbits(BELT, STARTS[BELT], Noise(sigma=0.01, tau=0.5), n_returns=returns, n_realisations=realisations)


def under_way(given: Any, result: Any) -> bool:
    return bool(given[3].count[modes.MADE] < len(given[4].found.codes))


CASES: dict[str, tuple[Any, str, Callable[[int], Any], Callable[[Any, Any], bool]]] = {
    "sums with modes": (totals, "observed_modes", lambda n: summed(BELT, 1, n), lambda _, done: not done),
    "sums with modes in threads": (totals, "observed_modes", lambda n: summed(BELT, 40, n // 10), lambda _, done: not done),
    "sums of impacts": (totals, "observe_flights", lambda n: summed(PAIR, 1, n), lambda _, done: not done),
    "sums of impacts in threads": (totals, "observe_flights", lambda n: summed(PAIR, 40, n // 10), lambda _, done: not done),
    "slopes with modes": (totals, "mode_slopes", lambda n: slopes(n // 10), lambda given, _: len(given[4]) < MANY // 10),
    "noise with modes": (modes, "noisy_motion", lambda n: noisy(n // 10, 1), under_way),
    "noise with modes in threads": (modes, "noisy_motion", lambda n: noisy(n // 100, 24), under_way),
    "orbit": (kernel, "orbits", lambda n: PAIR.orbits([STARTS[PAIR]], n), lambda given, _: len(given[3]) < MANY),
}


@pytest.mark.parametrize("name", CASES)
def test_ctrl_c_ends_compiled_loops(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    where, entry, run, unfinished = CASES[name]
    run(100)
    original, begun, ends = getattr(where, entry), threading.Event(), []

    def watched(*given: Any) -> Any:
        begun.set()
        result = original(*given)
        ends.append(unfinished(given, result))
        return result

    def press() -> None:
        begun.wait()
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(where, entry, watched)
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)  # also behind a shell that ignores it
    presses = threading.Timer(0.1, press)
    presses.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            run(MANY)
    finally:
        presses.join()
        signal.signal(signal.SIGINT, handler)
    assert all(ends)


def test_a_run_stopped_between_two_steps_says_what_was_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), resumable("again", tmp_path):
        raise KeyboardInterrupt
    (tmp_path / PARTS / "orbits").mkdir(parents=True)
    (tmp_path / PARTS / "surfaces.npz").touch()
    for done, steps in ((), "surfaces"), (("system", "orbits"), "system, orbits"):
        with pytest.raises(typer.Exit), resumable("again", tmp_path, done):
            raise KeyboardInterrupt
        assert capsys.readouterr().err == f"stopped; {tmp_path} keeps the finished steps: {steps}\nto resume: again\n"


def test_workers_end_with_what_stops_them() -> None:
    waiting = []

    def stopped(executor: Executor) -> None:
        waiting.append(executor.submit(sleep, 60))
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), processes(2) as executor:
        stopped(executor)  # type: ignore[arg-type]
    assert isinstance(waiting[0].exception(timeout=0), BrokenExecutor)
