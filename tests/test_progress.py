"""What long calls say on a terminal and nowhere else, and that they stop where they are told to, with what was finished."""

import sys
import threading
from io import StringIO
from math import inf, pi

import numpy as np
import pytest
from screens import Terminal

import nsmaps
from nsmaps import progress
from nsmaps.auxiliary.attracting_domain import smallest_box
from nsmaps.parallel import Parallel
from nsmaps.progress import CLEAR, beat, display, outermost, portion, shows, silent, working

BOX = [[0.7, 1.0], [0.2, 1.14]]


def looked_at(monkeypatch):
    """Standard error from now on: not from a fixture, after which pytest sets its own."""
    monkeypatch.setattr(progress, "AFTER", 0.01)
    monkeypatch.setattr(progress, "EVERY", 0.01)
    monkeypatch.setattr(sys, "stderr", stream := Terminal())
    return stream


def lines(stream):
    return [line for line in stream.getvalue().split(CLEAR) if line]


def waits(seconds=0.1):
    threading.Event().wait(seconds)


def test_a_line_says_how_far_a_call_is_and_is_gone_after_it(monkeypatch):
    terminal = looked_at(monkeypatch)
    with working("long call"):
        waits()
        beat(0.25, "7 parts")
        waits()
    assert lines(terminal)[0] == "long call: 0:00"
    assert lines(terminal)[-1] == "long call: 25 %, 0:00, 7 parts"
    assert terminal.getvalue().endswith(CLEAR)
    assert "\n" not in terminal.getvalue()


def test_a_line_never_wraps(monkeypatch):
    terminal = looked_at(monkeypatch)
    monkeypatch.setenv("COLUMNS", "24")
    with working("a long name of a call"):
        beat(0.25, "7 parts")
        waits()
    assert lines(terminal)[-1] == "a long name of a call: "
    monkeypatch.setenv("COLUMNS", "40")
    with working("a long name of a call"):
        beat(0.25, "7 parts")
        waits()
    assert lines(terminal)[-1] == "a long name of a call: 25 %, 0:00"


def test_only_the_outermost_call_is_shown(monkeypatch):
    terminal = looked_at(monkeypatch)
    inner = shows(lambda: waits(0.05))
    with working("outer"):
        inner()
        inner()
    assert {line.split(":")[0] for line in lines(terminal)} == {"outer"}
    with silent():
        inner()
    assert {line.split(":")[0] for line in lines(terminal)} == {"outer"}


def test_one_that_is_given_a_progress_is_silent(monkeypatch):
    terminal = looked_at(monkeypatch)
    call = shows(lambda progress=None: waits(0.05))
    call(progress=print)
    assert terminal.getvalue() == ""
    call()
    assert terminal.getvalue() != ""


@shows
def counts(n, progress=None):
    for k in range(n):
        beat((k + 1) / n, f"{k + 1} of {n}")


@shows
def counts_within(progress=None):
    counts(4)
    beat(0.5)
    counts(2, progress=portion(lambda share: beat_outer.append(share), 0.5, 1.0))


beat_outer: list[float] = []


def test_a_progress_hears_of_its_own_call_and_not_of_calls_within():
    seen = []
    counts(4, progress=seen.append)
    assert seen == [0.25, 0.5, 0.75, 1]
    seen.clear()
    beat_outer.clear()
    counts_within(progress=seen.append)
    assert seen == [0.5, 1], "a call that ends is finished, whatever it reported last"
    assert beat_outer == [0.75, 1]


@shows
def fails(progress=None):
    beat(0.5)
    raise ZeroDivisionError


def test_a_call_that_fails_is_not_reported_as_finished():
    seen = []
    with pytest.raises(ZeroDivisionError):
        fails(progress=seen.append)
    assert seen == [0.5]


def test_one_line_shows_the_calls_of_a_program_one_after_the_other(monkeypatch):
    terminal = looked_at(monkeypatch)
    with display(0.01):
        for name in ("first", "second"):
            with working(name):
                waits(0.05)
    assert [line.split(":")[0] for line in dict.fromkeys(lines(terminal))] == ["first", "second"]


REPORTING = {
    "attracting_domain": lambda system, how: nsmaps.attracting_domain(
        system, BOX, max_updates=3, bounds_kind="sampled", n_samples=21, **how
    ),
    "strip_map": lambda system, how: nsmaps.reduced.strip_map(system, ((0.6, 0.95), (0.1, 1.0)), 1e-2, **how),
    "morse_sets": lambda system, how: nsmaps.cells.morse_sets(system, BOX, depth=2, **how),
    "find_cycles": lambda system, how: nsmaps.cells.find_cycles(system, BOX, max_period=1, depth=2, **how),
    "exit_times": lambda system, how: nsmaps.cells.exit_times(system, {"all": WHOLE}, BOX, depth=1, n_cells=8, **how),
    "orbit": lambda system, how: nsmaps.orbit(system, [0.2, 0.1], 300_000, **how),
    "partition": lambda system, how: nsmaps.partition(system, GRID, nsmaps.Partition(tolerance=0.05, kind="accurate"), **how),
}
WHOLE = nsmaps.Box(coordinates=("v", "phi"), bounds={"v": (0.7, 1.0), "phi": (0.2, 1.14)})
GRID = nsmaps.Grid(axes={"v": nsmaps.Axis(low=0.7, high=1, points=11), "phi": nsmaps.Axis(low=0.2, high=1.14, points=11)})


@pytest.mark.parametrize("name", REPORTING)
def test_every_progress_is_a_fraction_that_ends_with_one(name, pair):
    seen = []
    REPORTING[name](pair(0.35), {"progress": seen.append})
    assert len(seen) > 1
    assert min(seen) >= 0
    assert seen[-1] == 1
    assert seen.count(1) == 1


@pytest.mark.parametrize(
    "call",
    [
        lambda system, parallel: nsmaps.bifurcation_diagram(
            system, "d", [0.3, 0.35], [0.8, 0.3], n_returns=20, transient=20, parallel=parallel
        ),
        lambda system, parallel: nsmaps.basins(
            system, np.random.default_rng(1).uniform(0.2, 1, (50, 2)), max_returns=200, parallel=parallel
        ),
        lambda system, parallel: nsmaps.lyapunov(
            system, "d", [0.3, 0.35], [0.8, 0.3], n_returns=64, transient=20, parallel=parallel
        ),
        lambda system, parallel: nsmaps.noisy_orbits(
            system, [0.8, 0.3], nsmaps.Noise(sigma=0.01, tau=0.5), n_returns=2, n_realisations=20, parallel=parallel
        ),
    ],
    ids=["bifurcation", "basins", "lyapunov", "noisy_orbits"],
)
def test_the_progress_of_jobs_is_such_a_fraction(call, pair):
    seen = []
    call(pair(0.35), Parallel(progress=seen.append))
    assert seen == sorted(seen)
    assert min(seen) >= 0
    assert (seen[-1], seen.count(1)) == (1, 1)
    assert len(seen) > 1


def test_another_thread_is_silent_and_an_error_takes_the_line_away(monkeypatch):
    terminal = looked_at(monkeypatch)
    thread = threading.Thread(target=shows(lambda: waits(0.05)))
    thread.start()
    thread.join()
    assert terminal.getvalue() == ""
    with pytest.raises(ZeroDivisionError):
        shows(lambda: waits(0.05) or 1 / 0)()
    assert terminal.getvalue().endswith(CLEAR)
    assert outermost() is None


def test_nothing_is_said_elsewhere_or_of_what_is_quick(monkeypatch):
    for stream in (StringIO(), Terminal(), None):
        monkeypatch.setattr(sys, "stderr", stream)
        with working("call"):
            waits(0.05)
        assert stream is None or stream.getvalue() == ""


@pytest.mark.parametrize(
    ("name", "call"),
    [
        (
            "attracting domain",
            lambda system: nsmaps.attracting_domain(system, BOX, max_updates=2, bounds_kind="sampled", n_samples=21),
        ),
        ("smallest box", lambda system: smallest_box(system, BOX, 21, bounds_kind="sampled")),
        ("strip map", lambda system: nsmaps.reduced.strip_map(system, ((0.7, 0.9), (0.2, 0.7)), 1e-2)),
        (
            "bifurcation_diagram",
            lambda system: nsmaps.bifurcation_diagram(system, "d", [0.3, 0.35], [0.8, 0.3], n_returns=20, transient=20),
        ),
        ("basins", lambda system: nsmaps.basins(system, np.random.default_rng(1).uniform(0.2, 1, (50, 2)), max_returns=200)),
        ("morse_sets", lambda system: nsmaps.cells.morse_sets(system, BOX, depth=1)),
        ("find_cycles", lambda system: nsmaps.cells.find_cycles(system, BOX, max_period=1, depth=1)),
        ("orbit", lambda system: nsmaps.orbit(system, [0.2, 0.1], 200_000)),
    ],
)
def test_long_calls_are_shown(name, call, pair, monkeypatch):
    seen = []
    system = pair(0.35)
    looked_at(monkeypatch)
    monkeypatch.setattr(progress, "_show", lambda stack, done, after: seen.append(stack[0].name))
    call(system)
    assert seen == [name]


RUN = """
title: An orbit and a diagram
system: bouncing_ball
parameters: {Gamma: 1.2}
grid: {v: {from: 1, to: 5, points: 3}, phi: {from: 0, to: 2*pi, points: 3}}
orbits: [{start: {v: 4, phi: 0.5}, n_returns: 40000}]
bifurcation_diagram:
  {parameter: Gamma, from: 1.1, to: 1.3, points: 40, starts: [{v: 4, phi: 0.5}], n_returns: 200, transient: 200}
"""


def test_a_run_says_its_step(monkeypatch, tmp_path):
    seen = []

    def note(stack, done, after):
        while not done.wait(0.0005):
            seen.extend(work.line() for work in stack[:1])

    (tmp_path / "small.yaml").write_text(RUN)
    looked_at(monkeypatch)
    monkeypatch.setattr(progress, "_show", note)
    nsmaps.run_study(tmp_path / "small.yaml")
    assert any("bifurcation_diagram (4 of 4), " in line and " of 40 values" in line for line in seen)
    assert all(line.startswith("small:") for line in seen)
    seen.clear()
    told = []
    nsmaps.run_study(tmp_path / "small.yaml", progress=lambda share: told.append((outermost().step, outermost().note, share)))
    assert seen == []
    assert {"orbits", "bifurcation_diagram"} <= {step for step, _, _ in told}
    assert any(note.endswith(" of 40 values") for step, note, _ in told if step == "bifurcation_diagram")
    shares = [share for *_, share in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1


def test_a_domain_stops_in_time_with_the_updates_that_are_finished(pair):
    whole = nsmaps.attracting_domain(pair(0.35), BOX, max_updates=3)
    part = nsmaps.attracting_domain(pair(0.35), BOX, max_updates=3, max_seconds=0)
    assert len(whole.updates) > len(part.updates) == 1
    assert np.array_equal(part.boxes, whole.boxes[:2])
    assert (part.forward_invariant, part.converged) == (True, False)
    assert part.reason.endswith("stopped after 0 s, with update 1 of 3")
    assert "stopped" not in whole.reason


def test_a_box_that_is_not_grown_in_time_is_none(pair):
    box, why = smallest_box(pair(0.35), [[0.8, 0.81], [0.4, 0.41]], bounds_kind="sampled", max_seconds=0)
    assert box is None
    assert why == "stopped after 0 s: grown 0 times to v in [0.8, 0.81] x phi in [0.4, 0.41]"
    domain = nsmaps.attracting_domain(pair(0.35), [[0.8, 0.81], [0.4, 0.41]], grow=True, bounds_kind="sampled", max_seconds=0)
    assert (domain.forward_invariant, domain.converged) == (False, False)
    assert "stopped after 0 s" in domain.reason


@pytest.mark.parametrize("seconds", [0.0, 0.2, inf])
def test_a_map_of_strips_stops_in_time_and_leaves_the_rest_to_the_exact_map(seconds, pair):
    system = pair(0.30)
    made = nsmaps.reduced.strip_map(system, ((0.6, 1.2), (0.0, pi)), 1e-4, max_seconds=seconds)
    assert made.strips.report.stopped == (seconds < inf)
    if seconds == 0:
        assert made.strips.report.exact_share == pytest.approx(1)
    states = np.random.default_rng(2).uniform([0.6, 0], [1.2, 3.14], (500, 2))
    strips, exact = made.first_return(states), system.first_return(states)
    assert np.array_equal(strips.outcome == 0, exact.outcome == 0)
    assert np.nanmax(np.abs(strips.lifted - exact.lifted)) < 3e-4


def test_a_map_of_strips_with_many_edges_stops_while_these_are_told_apart(pair):
    made = nsmaps.reduced.strip_map(pair(0.35), ((0.5, 15), (0.0, 2 * pi)), 1e-4, max_seconds=1)
    assert made.strips.report.stopped
    assert sum(made.strips.report.seconds.values()) < 60  # minutes without a limit; the rounds begun are finished
