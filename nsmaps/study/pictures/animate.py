"""Figures that move: the return surfaces turning round, and a cobweb of the composite map growing step by step."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from subprocess import CalledProcessError
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D

from nsmaps.arrays import Floats
from nsmaps.coordinates import nearest_turn
from nsmaps.errors import NsmapsError, check_known
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.exact.surfaces.sweep import surfaces as surfaces_of
from nsmaps.figures.composite.areas import colours_over
from nsmaps.figures.composite.cobweb import composite_orbit, draw_pieces, look
from nsmaps.figures.lines import finite_states, staircase
from nsmaps.figures.page import Sheet
from nsmaps.figures.returns.surfaces import AZIMUTH, ELEVATION
from nsmaps.figures.returns.surfaces import sheets as surface_sheets
from nsmaps.figures.style import drawing, piece_label
from nsmaps.progress import Progress, beat, shows
from nsmaps.results import units_of
from nsmaps.study.sections.longrun.orbits import ORBITS
from nsmaps.study.sections.maps.composite import COMPOSITE
from nsmaps.study.sections.maps.surfaces import GRID, MESH, PLANES

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

Writer = PillowWriter | FFMpegWriter

_WRITERS: Mapping[str, type[Writer]] = {"gif": PillowWriter, "mp4": FFMpegWriter}
_TURN, _STEPS = 72, 40  #: pictures of a whole turn, and steps of an orbit, where no number is named
_WIDTH = 8.0  #: inches
_FINE = 120  #: points of a grid that turns round, along an axis: a cell is then a few pixels wide
_EARLY, _LONGER = 8, 3  #: pictures of a cobweb that are shown longer than the later ones, and how many times as long
_PALE = 0.35  #: opacity of the pieces at rest


@dataclass(frozen=True, slots=True)
class Film:
    """A figure, what shows its pictures by number, and how many there are."""

    figure: Figure
    show: Callable[[int], None]
    frames: int
    fps: int  #: pictures a second, of the early ones where there are any
    early: int = 0  #: pictures that are shown longer than the others


@shows
def animate(
    result: "StudyResult",
    name: str,
    folder: str | Path,
    file_format: str = "gif",
    *,
    orbit: int = 1,
    frames: int | None = None,
    fps: int | None = None,
    dpi: float = 100,
    progress: Progress | None = None,
) -> Path:
    """The file of an animation, `surfaces` or `cobweb`, written into `folder`, which is made if it is not there.

    `surfaces` turns the return surfaces round once in `frames` pictures (supplementary video 1); `cobweb` shows the first
    `frames` - 1 returns of an orbit, by number from 1, one a picture (video 2), the first ones slowly unless `fps` is given.
    The file appears whole or not at all.

    Raises:
        NsmapsError: an unknown animation or format; data that the result lacks; `mp4` without ffmpeg.
    """
    for kind, word, accepted in (("animation", name, FILMS), ("format", file_format, _WRITERS)):
        check_known(f"there is no {kind}", word, accepted)
    if not _WRITERS[file_format].isAvailable():
        raise NsmapsError(
            f"an animation in {file_format} is written by the program ffmpeg, which is not on the path; expected: ffmpeg "
            "(apt install ffmpeg, brew install ffmpeg, conda install ffmpeg), or the format gif"
        )
    path = Path(folder) / f"{name}.{file_format}"
    with drawing(units_of(result.system)):
        film = FILMS[name](result, frames, orbit)
        path.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=path.parent, prefix=".animate-", ignore_cleanup_errors=True) as beside:
            unfinished = Path(beside) / path.name
            try:
                held = 0 if fps else film.early
                writer = _WRITERS[file_format](fps=fps or film.fps * (_LONGER if held else 1))
                _write(film, writer, unfinished, dpi, held)
            except CalledProcessError as error:
                raise NsmapsError(
                    f"no {file_format} was written: ffmpeg ended with exit code {error.returncode}; expected: the format gif"
                ) from error
            os.replace(unfinished, path)
    return path


def _write(film: Film, writer: Writer, path: Path, dpi: float, early: int) -> None:
    """Every picture, written one after the other, early ones and their last several times; panels stay as in the first."""
    film.show(0)
    film.figure.draw_without_rendering()
    film.figure.set_layout_engine("none")
    writer.setup(film.figure, str(path), dpi)
    times = np.ones(film.frames, int)
    if early:
        times[:early], times[-1] = _LONGER, 2 * _LONGER
    for k, count in enumerate(times.tolist()):
        film.show(k)
        for _ in range(count):
            writer.grab_frame()
        beat((k + 1) / film.frames)
    writer.finish()


def _turning(result: "StudyResult", frames: int | None, orbit: int) -> Film:
    """The sheet of surfaces, seen from all sides, over a grid not finer than the pictures."""
    named = PLANES.of(result, "surfaces")
    grid = next(iter(named.values())).grid
    coarse = {name: axis.model_copy(update={"points": min(axis.points, _FINE)}) for name, axis in grid.axes.items()}
    surfaces = surfaces_of(result.system, Grid(axes=coarse), [result.family(name) for name in named])
    (sheet,) = surface_sheets(surfaces, MESH.of(result.with_parts({"surfaces": surfaces}), "surfaces"))
    figure, count = sheet.figure(width=_WIDTH), frames or _TURN
    spaces = [ax for ax in figure.axes if isinstance(ax, Axes3D)]

    def show(k: int) -> None:
        for space in spaces:
            space.view_init(elev=ELEVATION, azim=AZIMUTH + 360 * k / count)

    return Film(figure, show, count, 12)


def _stepping(result: "StudyResult", frames: int | None, orbit: int) -> Film:
    """The cobwebs of one orbit, a panel a coordinate, above them the step and the piece that makes it."""
    composite, states = COMPOSITE.of(result, "cobweb"), finite_states(composite_orbit(ORBITS.of(result, "cobweb"), orbit - 1))
    count = min(frames or _STEPS, len(states))
    states = states[:count]
    by, count_of = composite.piece_of(states), np.cumsum(composite.returns_of(states))
    panels: list[_Cobweb] = []

    def panel(ax: Axes, i: int) -> Axes:
        panels.append(_Cobweb(result, ax, i, states))
        return ax

    coordinates = range(len(composite.coordinates))
    parts = tuple(lambda ax, i=i: panel(ax, i) for i in coordinates)
    figure = Sheet("cobweb", parts, len(parts), 0.88, title=" ", legend=True).figure(width=_WIDTH)

    def show(k: int) -> None:
        active = int(by[k - 1]) if k else -1
        for each in panels:
            each.show(k, active)
        title = f"return {count_of[k - 1]}, by {piece_label(composite.pieces[active].name)}" if active >= 0 else "start"
        figure.suptitle(title)

    return Film(figure, show, count, 1, _EARLY)


class _Cobweb:
    """One coordinate of an orbit over the pieces: the active piece stands out, as the curve on which the step lies."""

    def __init__(self, result: "StudyResult", ax: Axes, i: int, states: Floats) -> None:
        self._composite, self._states, self._i = COMPOSITE.of(result, "cobweb"), states, i
        grid = GRID.of(result, "cobweb")
        self._colours = colours_over(self._composite, grid, result.orbits)
        self._pieces = draw_pieces(self._composite, ax, i, grid, self._colours)
        (self._path,) = ax.plot([], [], color="0.2", lw=0.7, zorder=5, label="composite orbit")
        (self._curve,) = ax.plot([], [], lw=2.2, zorder=4, label="_")
        (self._point,) = ax.plot([], [], "o", color="black", ms=3.6, zorder=6, label="state")
        values = states[:, i]
        ax.plot(values[:1], values[:1], "o", mfc="white", mec="black", mew=0.8, ms=4.2, zorder=6, label="start")
        look(ax, values, self._composite.coordinates[i])
        self._x, self._middle = np.linspace(*ax.get_xlim(), 600), np.mean(ax.get_ylim())

    def show(self, step: int, active: int) -> None:
        """The first steps, and the piece that made the last of them, -1 for none."""
        for k, drawn in self._pieces.items():
            for artist in drawn:
                artist.set_alpha(1 if k == active else _PALE)
        values = self._states[: step + 1, self._i]
        self._path.set_data(*staircase(values))
        self._point.set_data(values[-1:], values[-1:])
        self._curve.set_data(self._x, self._section(step, active))
        self._curve.set_color(self._colours[active])

    def _section(self, step: int, active: int) -> Floats:
        """The images of the active piece over its coordinate, the others held where the step began; NaN outside of the piece."""
        if active < 0:
            return np.full(len(self._x), np.nan)
        line = np.repeat(self._states[step - 1 : step], len(self._x), axis=0)
        line[:, self._i] = self._x
        image = self._composite.first_return(line).image[:, self._i]
        if self._composite.coordinates.angles[self._i]:
            image = nearest_turn(image, self._middle)
        return np.where(self._composite.piece_of(line) == active, image, np.nan)


FILMS: Mapping[str, Callable[["StudyResult", int | None, int], Film]] = {"surfaces": _turning, "cobweb": _stepping}
