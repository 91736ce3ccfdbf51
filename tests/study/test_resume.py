"""Progress within steps, and a run that goes on where it was stopped."""

import shutil
import subprocess
import sys
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ball import BALL
from messages import message
from ruamel.yaml import YAML

from nsmaps import parallel as parts
from nsmaps import read_result, run_study
from nsmaps.dynamics.diagrams import bifurcation
from nsmaps.dynamics.diagrams import parts as diagrams
from nsmaps.dynamics.noise import orbits as noise
from nsmaps.errors import NsmapsError
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.interrupts import Interrupted
from nsmaps.progress import outermost
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.study import steps
from nsmaps.study.sections.maps import refits
from nsmaps.study.store import run_folder as folders


def test_progress_never_goes_back_and_tells_of_shares(good: str) -> None:
    Path("s.yaml").write_text(good)
    seen: list[tuple[str, float]] = []
    run_study("s.yaml", progress=lambda share: seen.append((outermost().step, share)))
    done = [share for _, share in seen]
    assert done == sorted(done)
    assert seen[0] == ("system", 0)
    assert done[-1] == 1
    orbits = [share for step, share in seen if step == "orbits"]
    assert orbits[0] == 3 / 5
    assert orbits[-1] == 4 / 5
    assert any(3 / 5 < share < 4 / 5 for share in orbits)


def stopped(study: str, at: str) -> Path:
    """The folder of a run that Ctrl-C stopped when a step began."""

    def stop(share: float) -> None:
        if outermost().step == at:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted):
        run_study(study, out="out", progress=stop)
    return Path("out")


def test_a_stopped_run_goes_on_without_computing_anything_twice(good: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("s.yaml").write_text(good)
    whole = run_study("s.yaml")
    folder = stopped("s.yaml", "orbits")
    assert not read_result(folder).finished
    made: list[str] = []
    step = steps.compute_step
    monkeypatch.setattr("nsmaps.study.run.compute_step", lambda name, *given: (made.append(name), step(name, *given))[1])
    again = run_study("s.yaml", out=folder, resume=True)
    assert made == ["orbits", "domains"]
    assert again.finished
    assert read_result(folder).finished
    assert list(again.timings) == list(whole.timings)
    assert again.verdicts == whole.verdicts
    assert np.array_equal(again.orbits[0].composite.states, whole.orbits[0].composite.states)
    assert np.array_equal(again.domain.boxes, whole.domain.boxes)


def test_the_study_is_written_once_however_many_steps_are_kept(good: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Writing YAML takes longer than some steps."""
    Path("s.yaml").write_text(good)
    written: list[object] = []
    plain = YAML.dump
    monkeypatch.setattr(YAML, "dump", lambda self, *given: (written.append(given), plain(self, *given))[1])
    run_study("s.yaml", out="out")
    assert len(written) == 1


def test_only_the_same_study_goes_on(good: str) -> None:
    Path("s.yaml").write_text(good)
    folder = stopped("s.yaml", "orbits")
    Path("s.yaml").write_text(good.replace("n_returns: 5", "n_returns: 6"))
    with pytest.raises(NsmapsError, match=message("study.other-run", study="s", what="study")):
        run_study("s.yaml", out=folder, resume=True)
    assert not read_result(folder).finished, "what is there stays"
    assert run_study("s.yaml", out=folder).finished, "from the beginning it may"


def test_a_folder_that_is_not_there_begins() -> None:
    Path("s.yaml").write_text("system: ball\nparameters: {a: 0.2}\norbits: [{start: {v: 0.3, phi: 1}, n_returns: 3}]\n")
    assert run_study("s.yaml", out="new", resume=True).finished


LONG = """\
system: ball
parameters: {a: 0.2}
bifurcation_diagram: {parameter: a, from: 0.2, to: 0.4, points: 7, starts: [{v: 0.3, phi: 1}], n_returns: 4, transient: 16}
noise:
  {sigma: [0.01, 0.02], tau: 0.5, start: {v: 0.3, phi: 1}, n_returns: 3, n_realisations: 20, modes: {ones: [BB]}}
"""


@pytest.mark.parametrize("follow", [None, "up"])
def test_a_section_goes_on_at_its_finished_parts(monkeypatch: pytest.MonkeyPatch, follow: str | None) -> None:
    text = LONG if follow is None else LONG.replace("transient: 16", f"transient: 16, direction: {follow}")
    Path("s.yaml").write_text(text)
    monkeypatch.setattr(diagrams, "PART", 40)  # two values
    whole = run_study("s.yaml")
    assert not Path("parts").exists(), "without a folder nothing is kept"

    def stop(share: float) -> None:
        if share >= (1 + bifurcation.STATES * 3 / 7) / 3:  # two of four parts of the second of three steps
            raise KeyboardInterrupt

    with pytest.raises(Interrupted):
        run_study("s.yaml", out="out", progress=stop)
    assert len(list(Path("out/parts/bifurcation_diagram").rglob("part-*.npz"))) == 2
    made: list[float] = []
    attractor = diagrams.settled
    monkeypatch.setattr(
        diagrams, "settled", lambda return_map, *given: (made.append(return_map.a), attractor(return_map, *given))[1]
    )
    again = run_study("s.yaml", out="out", resume=True)
    assert np.allclose(made, np.linspace(0.2, 0.4, 7)[4:])
    assert np.array_equal(again.bifurcation_diagram["exact"].states, whole.bifurcation_diagram["exact"].states, equal_nan=True)
    assert not Path("out/parts").exists()


COMPOSITE = """\
system: ball
parameters: {a: 0.2}
grid: {v: {from: 0.01, to: 0.5, points: 11}, phi: {from: 0, to: 2*pi, points: 11}}
families: {low: [BB]}
composite:
  - {name: all, box: {v: [0, 1], phi: [0, 2*pi]}, family: low, fit: {full: {v: 2, phi: 3}}}
bifurcation_diagram:
  {parameter: a, from: 0.2, to: 0.4, points: 7, starts: [{v: 0.3, phi: 1}], n_returns: 4, transient: 16, map: [exact, composite]}
"""


@pytest.mark.parametrize("follow", [None, "both"])
def test_a_diagram_of_a_composite_map_goes_on_at_its_finished_values(monkeypatch: pytest.MonkeyPatch, follow: str | None) -> None:
    text = COMPOSITE if follow is None else COMPOSITE.replace("transient: 16", "transient: 16, direction: both")
    Path("s.yaml").write_text(text)
    whole = run_study("s.yaml")
    refit, values = refits.refit, []

    def stop(plan: object, system: ImpactSystem) -> object:
        if len(values) == 3:
            raise KeyboardInterrupt
        values.append(system.parameters["a"])
        return refit(plan, system)

    monkeypatch.setattr(refits, "refit", stop)
    with pytest.raises(Interrupted):
        run_study("s.yaml", out="out")
    assert len(list(Path("out/parts/bifurcation_diagram/composite").rglob("part-*.npz"))) == 3
    before = [*values]
    monkeypatch.setattr(refits, "refit", lambda plan, system: (values.append(system.parameters["a"]), refit(plan, system))[1])
    exact = diagrams.settled
    of: list[type] = []
    monkeypatch.setattr(
        diagrams, "settled", lambda return_map, *given: (of.append(type(return_map)), exact(return_map, *given))[1]
    )
    again = run_study("s.yaml", out="out", resume=True)
    assert np.allclose(sorted(set(np.round(values, 9))), np.linspace(0.2, 0.4, 7))
    assert values[:3] == before
    assert set(of) == {CompositeMap}, "the exact map's are read"
    for name in ("exact", "composite"):
        assert np.array_equal(again.bifurcation_diagram[name].states, whole.bifurcation_diagram[name].states, equal_nan=True)
    assert not Path("out/parts").exists()


@pytest.mark.parametrize("follow", ["", ", direction: up", ", direction: both"])
def test_a_diagram_is_counted_once(follow: str) -> None:
    Path("s.yaml").write_text(COMPOSITE.replace("transient: 16", f"transient: 16{follow}"))
    seen: list[float] = []
    run_study("s.yaml", progress=lambda share: seen.append(4 * share - 3) if outermost().step == "bifurcation_diagram" else None)
    count = 7 * 2 * (2 if "both" in follow else 1)  # values, maps, ways
    assert len(seen) > count
    assert np.allclose((seen[0], seen[-1]), (0, 1))
    assert seen == sorted(seen)


def test_noise_goes_on_at_its_finished_parts_and_a_fresh_run_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("s.yaml").write_text(LONG)
    whole = run_study("s.yaml")
    made: list[range] = []
    realised, written = noise._realised, parts._Folder.write

    @wraps(realised)
    def noted(how: tuple, starts: np.ndarray, numbers: range) -> dict:
        made.append(numbers)
        return realised(how, starts, numbers)

    def stop(folder: parts._Folder, number: int, arrays: parts.Arrays) -> None:
        written(folder, number, arrays)
        if len(list(Path("out/parts/noise").rglob("part-*.npz"))) == 4:
            raise KeyboardInterrupt

    monkeypatch.setattr(noise, "_realised", noted)
    monkeypatch.setattr(parts._Folder, "write", stop)
    with pytest.raises(Interrupted):
        run_study("s.yaml", out="out")
    assert "bifurcation_diagram" in read_result("out").timings
    assert not Path("out/parts/bifurcation_diagram").exists(), "it is in the result"
    shutil.copytree("out", "other")
    made.clear()
    monkeypatch.setattr(parts._Folder, "write", written)
    again = run_study("s.yaml", out="out", resume=True)
    assert len(made) == 2, "of six"
    assert again.noise.stays[1].time.tolist() == whole.noise.stays[1].time.tolist()
    assert not Path("out/parts").exists()
    made.clear()
    run_study("s.yaml", out="other")
    assert len(made) == 6, "from the beginning"


class Killed(BaseException):
    """What no program can answer, as kill -9."""


def killed(study: str, at: str, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a run that was killed in a step."""

    def compute(name: str, *given: Any) -> Any:
        if name == at:
            raise Killed
        return steps.compute_step(name, *given)

    with monkeypatch.context() as patch:
        patch.setattr("nsmaps.study.run.compute_step", compute)
        with pytest.raises(Killed):
            run_study(study, out="out")
    return Path("out")


def made_by(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the steps that are computed from now on."""
    made: list[str] = []
    step = steps.compute_step
    monkeypatch.setattr("nsmaps.study.run.compute_step", lambda name, *given: (made.append(name), step(name, *given))[1])
    return made


def test_a_killed_run_goes_on_after_its_last_step(good: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("s.yaml").write_text(good)
    whole = run_study("s.yaml")
    folder = killed("s.yaml", "domains", monkeypatch)
    assert not (folder / "result.json").exists()
    (folder / "parts" / "surfaces.npz").write_bytes(b"cut off")
    (folder / "parts" / ".unfinished-1").write_bytes(b"of a program that was killed")
    made = made_by(monkeypatch)
    again = run_study("s.yaml", out=folder, resume=True)
    assert made == ["surfaces", "domains"]
    assert list(again.timings) == list(whole.timings)
    assert again.verdicts == whole.verdicts
    assert np.array_equal(again.orbits[0].exact.states, whole.orbits[0].exact.states)
    assert sorted(path.name for path in folder.iterdir()) == ["arrays.npz", "result.json", "study.yaml"]


def test_steps_of_another_study_are_refused(good: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("s.yaml").write_text(good)
    folder = killed("s.yaml", "domains", monkeypatch)
    Path("s.yaml").write_text(good.replace("n_returns: 5", "n_returns: 6"))
    with pytest.raises(NsmapsError, match=message("study.other-steps", folder="out", study="s")):
        run_study("s.yaml", out=folder, resume=True)


@pytest.mark.parametrize("file", ["result.json", "study.yaml", "arrays.npz"])
def test_what_is_broken_of_a_run_is_computed_again(good: str, file: str) -> None:
    Path("s.yaml").write_text(good)
    whole = run_study("s.yaml", out="out")
    a_study = [b"system: ball\n"] if file == "study.yaml" else []
    for content in (b"", Path("out", file).read_bytes()[:100], *a_study):
        Path("out", file).write_bytes(content)
        with pytest.raises(NsmapsError, match=message("study.unread", file=f"out/{file}")):
            read_result("out")
        with pytest.warns(RuntimeWarning, match=message("study.computed-again", file=f"out/{file}")):
            assert run_study("s.yaml", out="out", resume=True).verdicts == whole.verdicts
        assert read_result("out").finished


def test_a_warning_of_the_command_is_a_line() -> None:
    Path("mine.py").write_text(BALL)
    Path("s.yaml").write_text("system: mine.py:Ball\nparameters: {a: 0.2}\norbits: [{start: {v: 0.3, phi: 1}, n_returns: 3}]\n")
    run_study("s.yaml", out="out")
    Path("out/study.yaml").write_text("system: ball\n")
    command = [sys.executable, "-m", "nsmaps", "run", "s.yaml", "--out", "out", "--resume", "-q", "--no-figures", "--no-report"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stderr.startswith("RuntimeWarning: out/study.yaml cannot be read (it is not as the run wrote it); ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("moved", [0, 1, 2])
def test_a_result_that_was_ready_when_the_program_was_killed_is_there(good: str, moved: int) -> None:
    Path("s.yaml").write_text(good)
    run_study("s.yaml", out="out")
    ready = Path("out/.ready")
    ready.mkdir()
    for name in ("study.yaml", "arrays.npz", "result.json")[moved:]:
        Path("out", name).rename(ready / name)
    assert read_result("out").finished
    assert not ready.exists()


def test_a_disk_that_is_full_at_the_end_loses_no_step_and_no_earlier_result(good: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("s.yaml").write_text(good)
    run_study("s.yaml", out="out")
    before = {path.name: path.read_bytes() for path in Path("out").iterdir()}

    def full(path: Path, content: bytes) -> None:
        raise OSError(28, "No space left on device", str(path))

    with monkeypatch.context() as patch:
        patch.setattr(folders, "replace_file", full)
        with pytest.raises(NsmapsError, match=message("study.no-space", folder="out", reason="No space left on device")):
            run_study("s.yaml", out="out")
    assert {path.name: path.read_bytes() for path in Path("out").iterdir() if path.is_file()} == before
    assert {path.stem for path in Path("out/parts").iterdir()} == {"system", "surfaces", "composite", "orbits", "domains"}


def test_only_a_folder_with_finished_steps_is_said_to_have_them(tmp_path: Path) -> None:
    said = "cannot be written to (full); expected: free space and write permission"
    for more in ("", ". The finished steps are stored there: resume with --resume"):
        with pytest.raises(NsmapsError) as told, folders.writable(tmp_path):
            raise OSError("full")
        assert str(told.value) == f"{tmp_path} {said}{more}"
        (tmp_path / folders.PARTS / "system").mkdir(parents=True, exist_ok=True)


def test_a_folder_that_cannot_be_written_is_told_before_anything_is_computed(monkeypatch: pytest.MonkeyPatch, good: str) -> None:
    Path("s.yaml").write_text(good)
    Path("file").write_text("")
    made = made_by(monkeypatch)
    with pytest.raises(NsmapsError, match=message("study.not-a-folder", folder="file")):
        run_study("s.yaml", out="file/out")
    assert made == []
