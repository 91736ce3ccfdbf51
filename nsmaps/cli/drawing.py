"""Commands that draw: `nsmaps figures`, `animate` and `report`."""

import gc
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from mimetypes import guess_type
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nsmaps.cli.options import Folder, InstalledOnly, of_run
from nsmaps.cli.terminal import BAD, progress_line, reported_errors, say
from nsmaps.errors import NsmapsError
from nsmaps.progress import beat

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

Style = StrEnum("Style", ["journal"])  #: of figures, besides their own
Drawn = Annotated[
    Style | None,
    typer.Option(
        "--style", metavar="NAME", help="journal: serif type; units and titles of panels in a text file with the caption."
    ),
]
Format = StrEnum("Format", ["png", "svg", "pdf"])  #: file formats of figures
Formats = Annotated[
    list[Format] | None,
    typer.Option("--format", metavar="FORMAT", help="File format: png (the default), svg or pdf; may be repeated."),
]
Letters = Annotated[
    list[str] | None,
    typer.Option(
        metavar="FILE=LETTERS",
        help="Letters of the panels of a file, as cobweb=cd, a blank for none; a, b, c, ... by default; may be repeated.",
    ),
]
Grey = Annotated[
    bool,
    typer.Option("--grey", help="Also without colour, as grey-NAME.png, with the entries of legends that then look alike."),
]


def draw_listed(
    result: "StudyResult",
    names: Sequence[str],
    folder: Path,
    out: Path | None = None,
    kinds: Sequence[str] = ("png",),
    dpi: float = 300,
    width: float = 5.1,
    first: bool = False,
    letters: Mapping[str, str] | None = None,
    style: str = "",
    grey: bool = False,
) -> "tuple[list[Path], StudyResult]":
    """Figures of a run, drawn into a folder, its own if omitted, and the result, which says of each why if it was not drawn.

    One that cannot be drawn does not take the others with it. Those in the run's folder are listed with its results.
    """
    from nsmaps.study.pictures.draw import draw
    from nsmaps.study.store.archive import amend
    from nsmaps.study.store.run_folder import listed

    place, paths = out or folder / "figures", []
    lacking = {name: why for name, why in result.undrawn.items() if name not in names}
    every = list(dict.fromkeys(names))
    for number, name in enumerate(every):
        beat(number / len(every), f"{name} ({number + 1} of {len(every)})")
        try:
            with listed(folder, place) as beside, _settled():
                drawn = draw(result, [name], beside, kinds, dpi, width, first, letters, style, grey)
            paths += [place / path.name for path in drawn]
        except OSError:
            raise
        except Exception as error:
            lacking[name] = str(error) if isinstance(error, NsmapsError) else f"{type(error).__name__}: {error}"
    result, changed = replace(result, undrawn=lacking), lacking != result.undrawn
    if out is None and changed:
        amend(of_study(result), folder)
    return paths, result


def of_study(result: "StudyResult") -> "StudyResult":
    """The result, which says only of figures that its study names why they were not drawn: others were asked for once."""
    from nsmaps.study.pictures.catalogue import named_by

    names = named_by(result)
    return replace(result, undrawn={name: why for name, why in result.undrawn.items() if name in names})


@contextmanager
def _settled() -> Iterator[None]:
    """While figures are drawn, which makes and drops many objects, those that are there now are not searched for what may go."""
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def say_undrawn(result: "StudyResult", names: Sequence[str]) -> bool:
    """Say which of some figures could not be drawn, and why; whether there is one."""
    lacking = [name for name in names if name in result.undrawn]
    for name in lacking:
        say(f"the figure {name!r} cannot be drawn: {result.undrawn[name]}", err=True)
    return bool(lacking)


def _names(beginning: str) -> list[str]:
    """The figures whose name begins so, for the shell to complete."""
    from nsmaps.study.study import CATALOGUE

    return [name for name in CATALOGUE if name.startswith(beginning)]


def figures(
    folder: Folder,
    only: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="A figure; may be repeated.", autocompletion=_names)
    ] = None,
    formats: Formats = None,
    out: Annotated[Path | None, typer.Option(help="The folder to write to.", show_default="DIR/figures", file_okay=False)] = None,
    dpi: Annotated[
        float, typer.Option(metavar="N", min=10, help="Dots per inch of png, and of dense parts of svg and pdf.")
    ] = 300,
    width: Annotated[
        float, typer.Option(metavar="N", min=2, max=40, help="Width of a figure in inches; type stays at 8 points.")
    ] = 5.1,
    letters: Letters = None,
    style: Drawn = None,
    grey: Grey = False,
    installed_only: InstalledOnly = False,
) -> None:
    """Draw figures of a run again from its arrays: those that its study names, or any others for which it has the data.

    Of a figure with a sheet for every domain that of the first is drawn; `--only` draws all. A report that is in the folder is
    brought up to date.
    """
    from nsmaps.figures.page import GREY
    from nsmaps.study.pictures.catalogue import named_by
    from nsmaps.study.store.archive import read_result

    with reported_errors():
        result = read_result(folder, installed_only=installed_only)
        kinds = [kind.value for kind in formats or [Format.png]]
        names = only or named_by(result)
        lettered = _lettered(letters or [])
        paths, result = draw_listed(result, names, folder, out, kinds, dpi, width, not only, lettered, style or "", grey)
        if unknown := set(lettered) - {path.stem for path in paths} - set(result.undrawn):
            drawn = ", ".join(path.stem for path in paths)
            raise NsmapsError(f"--letters for {', '.join(sorted(unknown))}, which is not drawn; expected: {drawn}")
        if out is None and (folder / "report.html").is_file():
            from nsmaps.report.page import write_report

            write_report(of_study(result), folder)
    for path in paths:
        typer.echo(str(path))
        if path.name.startswith(GREY) and path.suffix == ".txt":
            say(f"alike in grey: {'; '.join(path.read_text(encoding='utf-8').splitlines())}")
    if say_undrawn(result, names):
        raise typer.Exit(BAD)


def _lettered(given: Sequence[str]) -> dict[str, str]:
    """Letters by file; NsmapsError for what is not FILE=LETTERS."""
    pairs = [each.partition("=") for each in given]
    for name, sign, letters in pairs:
        if not (name and sign and letters):
            raise NsmapsError(f"--letters {name + sign + letters}; expected: FILE=LETTERS, such as cobweb=cd")
    return {name: letters for name, _, letters in pairs}


def animate(
    folder: Folder,
    name: Annotated[str, typer.Argument(metavar="NAME", help="surfaces, in one rotation, or cobweb, step by step.")],
    file_format: Annotated[
        str | None,
        typer.Option("--format", metavar="FORMAT", help="gif, or mp4, which needs the program ffmpeg.", show_default="gif"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="The folder to write to, or the file, ending in .gif or .mp4.", show_default="DIR/figures")
    ] = None,
    orbit: Annotated[int, typer.Option(metavar="N", min=1, help="For cobweb: the number of the orbit in the study.")] = 1,
    frames: Annotated[
        int | None, typer.Option(metavar="N", min=2, help="Number of frames.", show_default="72, or 40 steps at most")
    ] = None,
    fps: Annotated[int | None, typer.Option(metavar="N", min=1, help="Frames per second.", show_default="12, or 1")] = None,
    dpi: Annotated[float, typer.Option(metavar="N", min=10, help="Dots per inch.")] = 100,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
    installed_only: InstalledOnly = False,
) -> None:
    """Write an animation of a run: its return surfaces in one rotation, or a cobweb of its composite map step by step."""
    from nsmaps.study.pictures.animate import animate
    from nsmaps.study.store.archive import read_result
    from nsmaps.study.store.run_folder import listed

    named = out if out is not None and out.suffix in (".gif", ".mp4") and not out.is_dir() else None
    place = named.parent if named else out or folder / "figures"
    kind = named.suffix[1:] if named else file_format or "gif"
    pictured = (guess_type(place.name)[0] or "").startswith(("image/", "video/")) and not place.is_dir()
    with of_run(folder), progress_line(quiet):
        if named is None and pictured:
            raise NsmapsError(f"--out {out}; expected: a folder, or a file that ends with .gif or .mp4")
        if file_format not in (None, kind):
            raise NsmapsError(f"--format {file_format} and --out {out}; expected: one format")
        result = read_result(folder, installed_only=installed_only)
        with listed(folder, place) as beside:
            path = animate(result, name, beside, kind, orbit=orbit, frames=frames, fps=fps, dpi=dpi)
            path = path.rename(beside / named.name) if named else path
    typer.echo(str(place / path.name))


def report(folder: Folder, installed_only: InstalledOnly = False) -> None:
    """Write report.html of a run again, also of a run that was stopped: verdicts, figures, numbers, timings, versions.

    It is one file that needs nothing but a browser, on a phone or on paper too. It holds the figures that are in the folder now.
    """
    from nsmaps.report.page import write_report
    from nsmaps.study.store.archive import read_result

    with of_run(folder):
        path = write_report(read_result(folder, installed_only=installed_only), folder)
    typer.echo(str(path))
