"""Compilation on another core of what later steps of a run call, while the first step compiles the exact map.

The other process calls the same functions once, with a state or box of no use, and so puts their code into the folder of compiled
code. What one of the two compiles the other waits for. Where all code is stored already, nothing is started.
"""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Floats

if TYPE_CHECKING:
    from nsmaps.exact.returnmap import ReturnMap
    from nsmaps.exact.systems.parameters import System
    from nsmaps.study.binding import Plan
    from nsmaps.study.reading.head import Head as Study


Call = Callable[["System"], None]  #: what puts code into the folder of compiled code


def call_composite(system: "System") -> None:
    """One orbit of a composite map of one piece, and the image of one box."""
    from nsmaps.reduced.composite.composite import CompositeMap, Piece
    from nsmaps.reduced.conditions.region import Box
    from nsmaps.reduced.fit.polymap import PolyMap

    names = system.coordinates
    piece = Piece("", Box.of(names, [[0.0, 1.0]] * len(names)), PolyMap.reset(names, {}))
    composite = CompositeMap(names, system.letters, (piece,))
    composite.orbits(np.zeros((1, len(names))), 1)
    composite.piece_of(np.zeros((1, len(names))))
    call_boxes(composite)


def call_boxes(system: "ReturnMap") -> None:
    """The image of one box, and the range of a function that is zero over it."""
    from nsmaps.enclosures.box_images import box_map
    from nsmaps.enclosures.branch_and_bound import Hulls, ranges

    n = len(system.coordinates)
    box = np.zeros((1, n, 2))
    box_map(system).image_boxes(box)

    def zero(boxes: Floats) -> Hulls:
        count = len(boxes)
        values = np.zeros((count, 1, 2))
        return Hulls(values, values, np.zeros((count, 1)), np.zeros((count, 1, 2, n, 2)), np.zeros((count, n)))

    ranges(zero, box, known=ranges(zero, box))


def call_noise(system: "System") -> None:
    """One return under noise."""
    from nsmaps.dynamics.noise.law import Noise
    from nsmaps.dynamics.noise.orbits import noisy_orbits
    from nsmaps.exact.systems.flow import FlowSystem

    noise = {"noise": Noise(sigma=0, tau=1), "step": 1} if isinstance(system, FlowSystem) else {"noise": Noise(sigma=0)}
    noisy_orbits(system, np.zeros(len(system.coordinates)), n_returns=1, **noise)


def calls_of(study: "Study") -> list[Call]:
    """The calls whose code the steps of a study need, each once."""
    return list(dict.fromkeys(call for analysis in study.analyses().values() for call in analysis.calls()))


@contextmanager
def compiling_ahead(plan: "Plan", early: Callable[[], bool]) -> Iterator[None]:
    """Have the code of later steps compiled by another process, if code is found to be missing here while it is `early`."""
    from nsmaps.exact.compiling.compiled import missing

    calls = calls_of(plan.study)
    others: list[subprocess.Popen[bytes]] = []

    def start() -> None:
        if not others and early():
            others.extend(_started(plan.system, calls))

    if calls and sys.executable and (os.cpu_count() or 1) > 1:
        missing.append(start)
    try:
        yield
    finally:
        missing[:] = [each for each in missing if each is not start]
        for other in others:
            other.kill()
            other.wait()


def _started(system: "System", calls: list[Call]) -> list[subprocess.Popen[bytes]]:
    """The process that makes the calls; none if the system cannot be sent to one, or none can be started."""
    with suppress(OSError, pickle.PicklingError, AttributeError, TypeError):
        sent = pickle.dumps((system, calls))
        command = [sys.executable, "-m", __name__]
        other = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with suppress(OSError):  # it has ended already
            assert other.stdin is not None
            other.stdin.write(sent)
            other.stdin.close()
        return [other]
    return []


def _make_calls() -> None:
    """Make the calls of the standard input; one that fails is left to the run, which reports why."""
    system, calls = pickle.load(sys.stdin.buffer)
    for call in calls:
        with suppress(Exception):
            call(system)


if __name__ == "__main__":
    _make_calls()
