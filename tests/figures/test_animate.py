"""Animations: as many pictures as asked, none like the one before, whole files only, and errors that say what to do."""

import os
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from messages import message
from PIL import Image, ImageSequence
from typer.testing import CliRunner

from nsmaps.cli.cli import app
from nsmaps.errors import NsmapsError
from nsmaps.study.pictures.animate import FILMS, animate


def pictures(path: Path) -> np.ndarray:
    """All pictures of a GIF, shape (frames, height, width, 3)."""
    with Image.open(path) as film:
        return np.array([np.asarray(picture.convert("RGB")) for picture in ImageSequence.Iterator(film)])


@pytest.mark.parametrize("name", FILMS)
def test_a_gif_has_the_pictures_asked_for_and_no_two_alike(result, tmp_path, name):
    shares = []
    path = animate(result, name, tmp_path / "new", frames=4, dpi=30, progress=shares.append)
    assert path == tmp_path / "new" / f"{name}.gif"
    film = pictures(path)
    assert len(film) == 4
    assert all((one != two).any() for one, two in pairwise(film))
    assert shares == [0.25, 0.5, 0.75, 1]
    assert list(path.parent.iterdir()) == [path]


def test_the_surfaces_turn_round_once_and_evenly(result):
    film = FILMS["surfaces"](result, 8, 1)
    seen = []
    for k in range(8):
        film.show(k)
        seen.append([ax.azim for ax in film.figure.axes])
    assert np.allclose(np.diff(seen, axis=0), 45)
    assert np.ptp(seen, axis=1).max() == 0


def test_each_step_of_the_cobweb_lies_on_the_curve_of_the_active_piece(result):
    orbit = result.orbits[0].composite
    film = FILMS["cobweb"](result, 6, 1)
    assert film.frames == 6
    for step in range(1, 6):
        film.show(step)
        active = int(result.composite.piece_of(orbit.states[step - 1 : step])[0])
        for i, ax in enumerate(film.figure.axes):
            lines = {line.get_label(): line for line in ax.lines}
            before, after = orbit.states[step - 1 : step + 1, i]
            assert lines["composite orbit"].get_xydata()[-1].tolist() == [after, after]
            assert lines["state"].get_xydata().tolist() == [[after, after]]
            x, y = lines["_"].get_data()
            assert np.interp(before, x[np.isfinite(y)], y[np.isfinite(y)]) == pytest.approx(after, abs=1e-6)
        assert result.composite.pieces[active].name[-1] in film.figure.get_suptitle()


def test_the_second_orbit_is_shown_where_it_is_asked_for(result):
    film = FILMS["cobweb"](result, 2, 2)
    film.show(0)
    lines = {line.get_label(): line for line in film.figure.axes[0].lines}
    assert lines["state"].get_xydata()[0, 0] == result.orbits[1].composite.states[0, 0]
    with pytest.raises(NsmapsError, match=message("figures.no-orbit", number=3, count=2)):
        FILMS["cobweb"](result, 2, 3)


def test_what_is_not_there_is_said(result, tmp_path, monkeypatch):
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="animation", name="cobwep", near="cobweb")):
        animate(result, "cobwep", tmp_path)
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="format", name="mp3", near="mp4")):
        animate(result, "cobweb", tmp_path, "mp3")
    with pytest.raises(
        NsmapsError,
        match=message("study.not-in-result", figure="cobweb", sections="'composite' or a 'partition' of kind closed_form"),
    ):
        animate(result.with_parts({"composite": None}), "cobweb", tmp_path)
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(NsmapsError, match=message("study.no-ffmpeg")):
        animate(result, "cobweb", tmp_path, "mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not FFMpegWriter.isAvailable(), reason="ffmpeg is not installed")
def test_an_mp4_is_one(result, tmp_path):
    path = animate(result, "cobweb", tmp_path, "mp4", frames=3, dpi=30)
    assert path.name == "cobweb.mp4"
    assert path.read_bytes()[4:8] == b"ftyp"


@pytest.mark.skipif(os.name == "nt", reason="a program here is a shell script")
def test_an_ffmpeg_that_fails_is_told(result, tmp_path, monkeypatch):
    program = tmp_path / "bin" / "ffmpeg"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\ncat > /dev/null\nexit 3\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent), prepend=os.pathsep)
    with pytest.raises(NsmapsError, match=message("study.ffmpeg-failed", format="mp4", number=3)):
        animate(result, "cobweb", tmp_path / "films", "mp4", frames=2, dpi=30)
    assert list((tmp_path / "films").iterdir()) == []


def test_ctrl_c_leaves_no_half_file_and_keeps_the_one_before(result, tmp_path):
    (tmp_path / "cobweb.gif").write_bytes(b"before")

    def pressed(share: float) -> None:
        if share > 0.25:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        animate(result, "cobweb", tmp_path, frames=4, dpi=30, progress=pressed)
    assert [path.name for path in tmp_path.iterdir()] == ["cobweb.gif"]
    assert (tmp_path / "cobweb.gif").read_bytes() == b"before"


def durations(path):
    """How long each picture of a GIF is shown, milliseconds."""
    with Image.open(path) as film:
        found = []
        for k in range(film.n_frames):
            film.seek(k)
            found.append(film.info["duration"])
    return found


@pytest.mark.thorough
def test_late_steps_of_a_cobweb_are_quicker_unless_a_rate_is_named(result, tmp_path, monkeypatch):
    monkeypatch.setattr("nsmaps.study.pictures.animate._EARLY", 2)
    shown = durations(animate(result, "cobweb", tmp_path, frames=5, dpi=30))
    assert shown == [990, 990, 330, 330, 1990], "the last stays"
    assert len(set(durations(animate(result, "cobweb", tmp_path, frames=5, dpi=30, fps=2)))) == 1
    assert len(set(durations(animate(result, "surfaces", tmp_path, frames=4, dpi=30)))) == 1


def test_a_file_is_written_where_one_is_named(tmp_path):
    stored = Path(__file__).parents[1] / "data" / "run-format-4" / "run"
    words = ["animate", str(stored), "cobweb", "--frames", "3", "--dpi", "30", "--quiet", "--out"]
    done = CliRunner().invoke(app, [*words, str(tmp_path / "new" / "anim.gif")])
    assert (done.exit_code, done.stdout) == (0, f"{tmp_path / 'new' / 'anim.gif'}\n")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["anim.gif"]
    assert (tmp_path / "new" / "anim.gif").read_bytes().startswith(b"GIF8")
    wrong = CliRunner().invoke(app, [*words, str(tmp_path / "other.gif"), "--format", "mp4"])
    assert wrong.exit_code == 2
    assert "--format mp4 and --out" in wrong.output


def test_the_command_tells_a_wrong_name_from_a_run(tmp_path):
    stored = Path(__file__).parents[1] / "data" / "run-format-4" / "run"
    done = CliRunner().invoke(app, ["animate", str(stored), "surfces", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert "no animation 'surfces', did you mean 'surfaces'?; expected: surfaces, cobweb" in done.output
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_another_kind_is_refused(tmp_path):
    done = CliRunner().invoke(app, ["animate", str(tmp_path), "cobweb", "--out", str(tmp_path / "x.png")])
    assert (done.exit_code, list(tmp_path.iterdir())) == (2, [])
    assert done.stderr == f"--out {tmp_path / 'x.png'}; expected: a folder, or a file that ends with .gif or .mp4\n"
