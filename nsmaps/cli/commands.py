"""Commands about files: `nsmaps copy`, `figures`, `animate`, `report`, `show`, `export`, `schema`, `cite` and `new-plugin`."""

import gc
import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nsmaps.cli.terminal import BAD, examples, progress_line, reported_errors, say, summary
from nsmaps.errors import NsmapsError
from nsmaps.exports.languages import LANGUAGES
from nsmaps.figures.catalogue import CATALOGUE, named_by

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

InstalledOnly = Annotated[
    bool, typer.Option("--installed-only", help="Refuse a study whose system is a class in a file, which would be run.")
]
MaxMemory = Annotated[
    float | None,
    typer.Option(
        metavar="GB",
        help="Gigabytes that a run may need, as estimated; if omitted NSMAPS_MAX_MEMORY, or those of the machine.",
        show_default=False,
    ),
]
MaxHours = Annotated[
    float | None,
    typer.Option(
        metavar="HOURS",
        help="Hours on one core that a run may need, as estimated; if omitted NSMAPS_MAX_HOURS, or 24.",
        show_default=False,
    ),
]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A folder that `nsmaps run` wrote.")]

Format = StrEnum("Format", ["png", "svg", "pdf"])  #: file formats of figures


def add_to(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(epilog=examples("nsmaps figures runs/vi_pair/fp --only cobweb --format pdf --format svg"))(figures)
    app.command(epilog=examples("nsmaps animate runs/vi_pair/fp cobweb", "nsmaps animate DIR surfaces --format mp4"))(animate)
    app.command(epilog=examples("nsmaps copy vi_pair/pd", "nsmaps copy vi_pair/pd mine.yaml"))(copy)
    app.command(epilog=examples("nsmaps report runs/vi_pair/fp"))(report)
    app.command(epilog=examples("nsmaps show runs/vi_pair/fp", "nsmaps show runs/vi_pair/fp | less"))(show)
    exports = examples("nsmaps export runs/vi_pair/fp --to c", "nsmaps export runs/vi_pair/fp --to c --iterate 2 --piece R1+")
    app.command(epilog=exports)(export)
    app.command(epilog=examples("nsmaps new-plugin shaken_ball", "nsmaps new-plugin soft_stop --hybrid --into ~/plugins"))(
        new_plugin
    )
    app.command(epilog=examples("nsmaps schema --out study.schema.json", "nsmaps schema | less"))(schema)
    app.command(epilog=examples("nsmaps cite", "nsmaps cite runs/vi_pair/fp >> references.bib"))(cite)


def draw_listed(
    result: "StudyResult",
    names: Sequence[str],
    folder: Path,
    out: Path | None = None,
    kinds: Sequence[str] = ("png",),
    dpi: float = 300,
    width: float = 5.1,
    first: bool = False,
) -> "tuple[list[Path], StudyResult]":
    """Figures of a run, drawn into a folder, its own if omitted, and the result, which says of each why if it was not drawn.

    One that cannot be drawn does not take the others with it. Those in the run's folder are listed with its results.
    """
    from nsmaps.figures import draw
    from nsmaps.study.store.archive import amend
    from nsmaps.study.store.run_folder import listed

    place, paths = out or folder / "figures", []
    lacking = {name: why for name, why in result.undrawn.items() if name not in names}
    for name in dict.fromkeys(names):
        try:
            with listed(folder, place) as beside, _settled():
                drawn = draw(result, [name], beside, kinds, dpi, width, first)
            paths += [place / path.name for path in drawn]
        except OSError:
            raise
        except Exception as error:
            lacking[name] = str(error) if isinstance(error, NsmapsError) else f"{type(error).__name__}: {error}"
    result, changed = replace(result, undrawn=lacking), lacking != result.undrawn
    if out is None and changed:
        amend(result, folder)
    return paths, result


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
    return [name for name in CATALOGUE if name.startswith(beginning)]


@contextmanager
def of_run(folder: Path) -> Iterator[None]:
    """As `reported_errors`; any other error, from a record that no run wrote, is reported on one line as well."""
    with reported_errors():
        try:
            yield
        except (NsmapsError, OSError, typer.Exit):
            raise
        except Exception as error:
            why = " ".join(f"{type(error).__name__}: {error}".split())
            raise NsmapsError(f"{folder} is not as `nsmaps run` writes it ({why}); run the study again") from error


def figures(
    folder: Folder,
    only: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="A figure; may be repeated.", autocompletion=_names)
    ] = None,
    format: Annotated[
        list[Format] | None, typer.Option(metavar="FORMAT", help="The file format: png, if omitted, svg or pdf; may be repeated.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The folder to write to.", show_default="DIR/figures", file_okay=False)] = None,
    dpi: Annotated[
        float, typer.Option(metavar="N", min=10, help="Dots per inch of png, and of what is dense in svg and pdf.")
    ] = 300,
    width: Annotated[
        float, typer.Option(metavar="N", min=2, max=40, help="The width of a figure, inches; type stays at 8 points.")
    ] = 5.1,
    installed_only: InstalledOnly = False,
) -> None:
    """Draw figures of a run again, from the arrays it kept: those that its study names, or any that it has the data for.

    Of a figure with a sheet for every domain that of the first is drawn; `--only` draws all. A report that is in the folder is
    brought up to date.
    """
    from nsmaps.study.store.archive import read_result

    with reported_errors():
        result = read_result(folder, installed_only=installed_only)
        kinds = [kind.value for kind in format or [Format.png]]
        names = only or named_by(result)
        paths, result = draw_listed(result, names, folder, out, kinds, dpi, width, first=not only)
        if out is None and (folder / "report.html").is_file():
            from nsmaps.report.page import write_report

            write_report(result, folder)
    for path in paths:
        typer.echo(str(path))
    if say_undrawn(result, names):
        raise typer.Exit(BAD)


def animate(
    folder: Folder,
    name: Annotated[str, typer.Argument(metavar="NAME", help="surfaces, turning round once, or cobweb, step by step.")],
    format: Annotated[
        str | None,
        typer.Option(metavar="FORMAT", help="gif, or mp4, which needs the program ffmpeg.", show_default="gif"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="The folder to write to, or the file, ending in .gif or .mp4.", show_default="DIR/figures")
    ] = None,
    orbit: Annotated[int, typer.Option(metavar="N", min=1, help="Of cobweb: which of the study's orbits.")] = 1,
    frames: Annotated[
        int | None, typer.Option(metavar="N", min=2, help="How many pictures.", show_default="72, or 40 steps at most")
    ] = None,
    fps: Annotated[int | None, typer.Option(metavar="N", min=1, help="Pictures a second.", show_default="12, or 1")] = None,
    dpi: Annotated[float, typer.Option(metavar="N", min=10, help="Dots per inch.")] = 100,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
    installed_only: InstalledOnly = False,
) -> None:
    """Write an animation of a run: its surfaces turning round, or a cobweb of its composite map growing step by step."""
    from nsmaps.figures.animate import animate
    from nsmaps.study.store.archive import read_result
    from nsmaps.study.store.run_folder import listed

    named = out if out is not None and out.suffix in (".gif", ".mp4") and not out.is_dir() else None
    place = named.parent if named else out or folder / "figures"
    kind = named.suffix[1:] if named else format or "gif"
    with of_run(folder), progress_line(quiet):
        if format not in (None, kind):
            raise NsmapsError(f"--format {format} and --out {out}; expected: one format")
        result = read_result(folder, installed_only=installed_only)
        with listed(folder, place) as beside:
            path = animate(result, name, beside, kind, orbit=orbit, frames=frames, fps=fps, dpi=dpi)
            path = path.rename(beside / named.name) if named else path
    typer.echo(str(place / path.name))


def report(folder: Folder, installed_only: InstalledOnly = False) -> None:
    """Write report.html of a run again: verdicts, what was asked, figures, numbers, timings, versions, how to cite.

    It is one file that needs nothing but a browser, on a phone or on paper too. It holds the figures that are in the folder now.
    """
    from nsmaps.report.page import write_report
    from nsmaps.study.store.archive import read_result

    with of_run(folder):
        path = write_report(read_result(folder, installed_only=installed_only), folder)
    typer.echo(str(path))


def show(folder: Folder, installed_only: InstalledOnly = False) -> None:
    """Print of a run, also an old one, what `nsmaps run` printed at its end: headline, tables, verdicts, what they come to.

    Nothing is computed or written.
    """
    from nsmaps.study.store.archive import read_result

    with of_run(folder):
        result = read_result(folder, installed_only=installed_only)
        summary(result)


def export(
    folder: Folder,
    to: Annotated[str, typer.Option(metavar="FORMAT", help=f"A language: {', '.join(LANGUAGES)}.")],
    out: Annotated[Path | None, typer.Option(help="The folder to write to.", show_default="DIR/export", file_okay=False)] = None,
    iterate: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Instead the N-th iterate of one piece, all coordinates.")
    ] = None,
    piece: Annotated[str | None, typer.Option(help="The piece of `--iterate`; needed if there are several.")] = None,
    installed_only: InstalledOnly = False,
) -> None:
    """Write the maps and closed forms of a run in another language; maps without a closed form are reported."""
    import nsmaps
    from nsmaps.exports.exportables import held_by
    from nsmaps.exports.write import export_iterate
    from nsmaps.study.store.run_folder import listed

    place = out or folder / "export"
    with of_run(folder):
        if piece is not None and iterate is None:
            raise nsmaps.NsmapsError(f"a piece {piece!r} and no iterate; expected: --iterate N --piece {piece}")
        result = nsmaps.read_result(folder, installed_only=installed_only)
        with listed(folder, place) as beside:
            files = export_iterate(result, iterate, piece, to, beside) if iterate else nsmaps.export(result, to, beside)
        left = () if iterate else held_by(result).skipped
    typer.echo("\n".join(str(place / name) for name in files))
    for line in left:
        say(f"not written: {line}", err=True)


def copy(
    study: Annotated[str, typer.Argument(metavar="STUDY", help="An installed study, such as vi_pair/pd.")],
    to: Annotated[
        Path | None, typer.Argument(metavar="[FILE]", help="The file to write, or its folder.", show_default="<study>.yaml")
    ] = None,
) -> None:
    """Copy a study that an installed system ships, to be edited; what it refers to is copied beside it.

    Nothing is overwritten. The copy's first line names the schema that is installed, for editors.
    """
    from nsmaps.study.reading.shipped import copy_study

    with reported_errors():
        paths = copy_study(study, to)
    typer.echo(f"written to {', '.join(map(str, paths))}\nto run it: {shlex.join(['nsmaps', 'run', str(paths[0])])}")


def new_plugin(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the system: small letters, digits and _.")],
    into: Annotated[Path, typer.Option(help="The folder in which the project's own folder is made.", file_okay=False)] = Path(),
    hybrid: Annotated[bool, typer.Option("--hybrid", help="Of a system with modes instead of an impact system.")] = False,
) -> None:
    """Write a little project for a system of your own: class, study, test and pyproject."""
    from nsmaps.newplugin import new_plugin

    with reported_errors():
        folder = new_plugin(name, into, hybrid)
    typer.echo(f'written to {folder}; next: pip install -e "{folder}[test]" && nsmaps run {name}/first && pytest "{folder}"')


def schema(
    out: Annotated[Path | None, typer.Option(help="Write it to a file, and say how a study names it.", dir_okay=False)] = None,
) -> None:
    """Print the JSON Schema of studies, by which an editor completes keys, says what they mean, and marks what is wrong.

    An editor with a YAML language server reads it by the first line of a study, which names the schema's file.
    """
    from importlib.resources import files

    from nsmaps.study.reading.shipped import MODELINE

    text = files("nsmaps.study").joinpath("schema.json").read_text(encoding="utf-8")
    if out is None:
        typer.echo(text, nl=False)
        return
    with reported_errors():
        out.write_text(text, encoding="utf-8")
    typer.echo(f"written to {out}; the first line of a study beside it:\n{MODELINE}{out.name}")


def cite(
    folder: Annotated[
        Path | None, typer.Argument(metavar="[DIR]", help="A run's folder, to be cited too.", show_default=False)
    ] = None,
    installed_only: InstalledOnly = False,
) -> None:
    """Print BibTeX of the software, of the paper whose method it implements, and of a run."""
    import nsmaps
    from nsmaps.report.cite import citation, run_citation

    entries = citation(nsmaps.__version__)
    if folder is not None:
        from nsmaps.study.store.archive import read_result

        with of_run(folder):
            result = read_result(folder, installed_only=installed_only)
            entries = citation(result.versions["nsmaps"])
            entries += "\n" + run_citation(result.study.name, result.study.title, result.versions, folder)
    typer.echo(entries)
