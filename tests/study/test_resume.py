"""Progress within steps, and a run that goes on where it was stopped."""

from pathlib import Path

import numpy as np
import pytest

from nsmaps import read_result, run
from nsmaps.errors import NsmapsError
from nsmaps.study import steps
from nsmaps.study.run import Interrupted


def test_progress_never_goes_back_and_tells_of_shares(good: str) -> None:
    Path("s.yaml").write_text(good)
    told: list[tuple[str, float, int]] = []
    run("s.yaml", progress=lambda *given: told.append(given))
    done = [share for _, share, _ in told]
    assert done == sorted(done)
    assert {total for *_, total in told} == {5}
    assert told[0] == ("system", 0, 5)
    assert told[-1] == ("done", 5, 5)
    orbits = [share for what, share, _ in told if what == "orbits"]
    assert orbits[0] == 3
    assert orbits[-1] == 3.999, "a step that is not done is never told as done"
    assert any(3 < share < 3.999 for share in orbits)


def stopped(study: str, at: str) -> Path:
    """The folder of a run that Ctrl-C stopped when a step began."""

    def stop(what: str, done: float, total: int) -> None:
        if what == at:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted):
        run(study, out="out", progress=stop)
    return Path("out")


def test_a_stopped_run_goes_on_without_computing_anything_twice(good: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("s.yaml").write_text(good)
    whole = run("s.yaml")
    folder = stopped("s.yaml", "orbits")
    assert not read_result(folder).finished
    made: list[str] = []
    for name, step in list(steps.STEPS.items()):
        monkeypatch.setitem(steps.STEPS, name, lambda *given, name=name, step=step: (made.append(name), step(*given))[1])
    again = run("s.yaml", out=folder, resume=True)
    assert made == ["orbits", "domains"]
    assert again.finished
    assert read_result(folder).finished
    assert list(again.timings) == list(whole.timings)
    assert again.verdicts == whole.verdicts
    assert np.array_equal(again.orbits[0].composite.states, whole.orbits[0].composite.states)
    assert np.array_equal(again.domain.boxes, whole.domain.boxes)


def test_only_the_same_study_goes_on(good: str) -> None:
    Path("s.yaml").write_text(good)
    folder = stopped("s.yaml", "orbits")
    Path("s.yaml").write_text(good.replace("returns: 5", "returns: 6"))
    with pytest.raises(NsmapsError, match="holds a run of 's' with another study than 's' now; accepted: the same study"):
        run("s.yaml", out=folder, resume=True)
    assert not read_result(folder).finished, "what is there stays"
    assert run("s.yaml", out=folder).finished, "from the beginning it may"


def test_a_folder_that_is_not_there_begins() -> None:
    Path("s.yaml").write_text("system: ball\nparameters: {a: 0.2}\norbits: [{start: {v: 0.3, phi: 1}, returns: 3}]\n")
    assert run("s.yaml", out="new", resume=True).finished
