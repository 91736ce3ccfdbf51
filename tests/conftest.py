"""Fixtures shared by all tests."""

import gc
import json
import os
import sys
from collections.abc import Callable, Iterable
from importlib import import_module
from math import pi
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: each of the tests' processes has one core
os.environ.pop("COLUMNS", None)  # which pytest-xdist sets
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # the many programs that tests start need not each compile the sources anew
from nsmaps_recoil_pair import RecoilPair
from nsmaps_vi_pair import VIPair

from nsmaps import observe, run_study
from nsmaps.study.ahead import call_boxes, call_composite, call_noise

sys.dont_write_bytecode = False  # the tests' second process need not rewrite the tests anew
gc.set_threshold(100_000, 50, 50)  # garbage is searched for more rarely among all that compilers keep

fcntl = None if os.name == "nt" else import_module("fcntl")

settings.register_profile("checks", derandomize=True)  # the same examples every time, where nobody looks on
if os.environ.get("CI"):
    settings.load_profile("checks")

DATA = Path(__file__).parent / "data"
TILT = {"pi/3": pi / 3, "pi/6": pi / 6}


def vi_pair(d: float, r: float = 0.5, beta: float = pi / 3) -> VIPair:
    return VIPair(d=d, r=r, M=0.1245, g=9.8, beta=beta, F=5)


PAIR, RECOIL = vi_pair(0.3), RecoilPair(eta=0.05, kappa=0.04, Lambda=0.2, d=0.35, g_bar=0.2113)
MANY = 100  #: tests, before which the engine is compiled
COMPILED = [
    lambda: PAIR.first_return([[0.5, 1.0]]),
    lambda: call_composite(PAIR),
    lambda: call_boxes(PAIR),
    lambda: call_noise(PAIR),
    lambda: RECOIL.first_return([[0.5, 0.1, -0.6, 1.0]]),
    lambda: call_boxes(RECOIL),
    lambda: call_noise(RECOIL),
    lambda: RECOIL.arrivals([[0.0, 0.1, 0.2, 0.3, 1.0]]),
    lambda: observe(RECOIL, [0.5, 0.1, -0.6, 1.0], ["loss"], n_returns=2, n_batches=1),
    lambda: observe(PAIR, [0.5, 1.0], ["loss"], n_returns=2, n_batches=1),
]


@pytest.fixture(scope="session")
def pair() -> Callable[..., VIPair]:
    """The VI pair with the paper's constants, by d, r and beta."""
    return vi_pair


@pytest.fixture(scope="session")
def reference() -> Callable[[str], list[dict[str, Any]]]:
    """The rows of one of the files of 50-digit references."""
    return lambda name: json.loads((DATA / f"{name}.json").read_text())["rows"]


@pytest.fixture(scope="session")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The folder of the run of a shipped study: the first test that asks for it runs the study, those of other processes wait."""
    own = tmp_path_factory.getbasetemp()
    base = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own

    def folder(name: str) -> Path:
        made = base / "shipped" / name
        with (base / "shipped.lock").open("w") as lock:
            if fcntl is not None:
                fcntl.flock(lock, fcntl.LOCK_EX)
            if not (made / "result.json").is_file():
                run_study(name, out=made)
        return made

    return folder


def worker(session: pytest.Session) -> str:
    """The name of a process of tests; "" where there is one only."""
    return getattr(session.config, "workerinput", {}).get("workerid", "")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Before all tests the second process compiles while the first reads them: it then finds what the first made of them."""
    if worker(session) == "gw1" and [Path(part).name for part in session.config.args] == ["tests"]:
        compile_from(reversed(COMPILED))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Before many tests two processes compile the engine, from both ends of a list; what one compiles the other loads."""
    if worker(session) in ("gw0", "gw1") and len(session.items) > MANY:
        compile_from(COMPILED if worker(session) == "gw0" else reversed(COMPILED))
    gc.freeze()  # what is loaded by now is there to the end, and need not be searched for garbage


def compile_from(calls: Iterable[Callable[[], object]]) -> None:
    """Make calls that compile what they call."""
    for call in calls:
        call()


def pytest_sessionfinish() -> None:
    """What is left at the end is searched for garbage once, not five times."""
    gc.collect()
    gc.freeze()
