"""The command line: `nsmaps systems | check STUDY | run STUDY | figures DIR | export DIR | new-plugin NAME`.

Exit codes: 0 done, 1 a required verdict fails, 2 the study or the command cannot be read, 130 stopped by Ctrl-C.
Nothing heavy is imported before a command needs it.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from rich.console import Console

    from nsmaps.study.result import StudyResult
    from nsmaps.study.spec import PieceSection, Study

FAILED, BAD, STOPPED = 1, 2, 130
WIDE = 200  #: columns of a table that goes to a file or a pipe

app = typer.Typer(
    help="Global analysis of non-smooth dynamics: a YAML study in, attracting domains with their verdicts out.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
StudyName = Annotated[str, typer.Argument(metavar="STUDY", help="A YAML file, or an installed study such as vi_pair/fp.")]


class Format(StrEnum):
    """File formats of figures."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


def main() -> None:
    """The console entry point. NumPy, not loaded yet, is to keep to one core: threads slow its many small problems."""
    for library in ("OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    app(prog_name="nsmaps")


def _print_version(asked: bool) -> None:
    if asked:
        import nsmaps

        typer.echo(f"nsmaps {nsmaps.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


@app.command()
def systems() -> None:
    """List the installed systems, their parameters and their studies."""
    import warnings

    from nsmaps import plugins

    names = plugins.system_names()
    for name in names:
        with _told(fatal=False), warnings.catch_warnings():
            cls = plugins.system_class(name)
            typer.echo(f"{name}: {_first_sentence(cls.__doc__)}")
            for parameter, field in cls.model_fields.items():
                default = "" if field.is_required() else f" (default {field.default})"
                typer.echo(f"  {parameter:8s} {field.description or ''}{default}")
            for quantity, description in cls.instead.items():
                typer.echo(f"  {quantity:8s} {description}")
            typer.echo(f"  studies: {', '.join(f'{name}/{stem}' for stem in plugins.study_files(name)) or 'none'}")
    if not names:
        typer.echo("no system is installed; install a package that gives one, or name a file: path/to/mine.py:Class")


@app.command()
def check(study: StudyName) -> None:
    """Read a study and say what a run of it would compute, without computing it."""
    from nsmaps.study.reader import load_study
    from nsmaps.study.steps import steps_of

    with _told():
        read = load_study(study)
    typer.echo(f"{read.name}: {read.title}" if read.title else read.name)
    given = ", ".join(f"{name} = {_short(value)}" for name, value in read.parameters.items())
    typer.echo(f"  system: {read.system} ({given or 'parameters as they come'})")
    for name in steps_of(read)[1:]:
        typer.echo(f"  {name}: {_about(read, name)}")
    if read.figures:
        typer.echo(f"  figures: {', '.join(read.figures)}")
    typer.echo(f"  required: {', '.join(_required(read)) or 'no verdict'}")


@app.command()
def run(
    study: StudyName,
    out: Annotated[
        Path | None, typer.Option(help="The folder to write to.", show_default="runs/<study>", file_okay=False)
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw no figures.")] = False,
) -> None:
    """Compute what a study names, write it to a folder, and end with a table of verdicts."""
    with _told(), _bar(quiet) as progress:
        progress("imports", 0, 1)
        begun = perf_counter()
        from nsmaps.study.reader import load_study
        from nsmaps.study.run import Interrupted
        from nsmaps.study.run import run as compute

        read = load_study(study)
        seconds = {"imports": perf_counter() - begun}
        folder = out or Path("runs", read.name)
        try:
            result = compute(read, folder, progress)
        except Interrupted as stopped:
            done = ", ".join(stopped.result.timings) or "nothing"
            typer.echo(f"stopped; {folder} keeps what was finished: {done}", err=True)
            raise typer.Exit(STOPPED) from None
        if read.figures and not no_figures:
            progress("figures", 0, 1)
            begun = perf_counter()
            _draw(result, folder, Format.png)
            seconds["figures"] = perf_counter() - begun
    if not quiet:
        _pieces(result)
        _table(result)
        spent = {"imports": 0.0, **result.timings, **seconds}
        typer.echo(f"seconds: {', '.join(f'{name} {time:.1f}' for name, time in spent.items())}")
        typer.echo(f"written to {folder}")
    if not result.holds:
        raise typer.Exit(FAILED)


@app.command()
def figures(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder that `nsmaps run` wrote.")],
    format: Annotated[Format, typer.Option(help="The file format.")] = Format.png,
) -> None:
    """Draw the figures of a run again, from the arrays it kept."""
    from nsmaps.study.archive import read_result

    with _told():
        paths = _draw(read_result(folder), folder, format)
    for path in paths:
        typer.echo(str(path))


@app.command()
def new_plugin(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the system: small letters, digits and _.")],
    into: Annotated[Path, typer.Option(help="The folder in which the project's own folder is made.", file_okay=False)] = Path(),
) -> None:
    """Write a little project for a system of your own: class, study, test and pyproject."""
    from nsmaps.newplugin import new_plugin

    with _told():
        folder = new_plugin(name, into)
    typer.echo(f"written to {folder}; next: pip install -e {folder} && nsmaps run {name}/first")


@app.command()
def export(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder that `nsmaps run` wrote.")],
    to: Annotated[str, typer.Option(metavar="FORMAT", help="latex, python, c, julia, matlab or json.")],
    out: Annotated[Path | None, typer.Option(help="The folder to write to.", show_default="DIR/export", file_okay=False)] = None,
) -> None:
    """Write the maps and closed forms of a run in another language."""
    import nsmaps

    with _told():
        files = nsmaps.export(nsmaps.read_result(folder), to, place := out or folder / "export")
    typer.echo("\n".join(str(place / name) for name in files))


@app.command()
def bench(
    returns: Annotated[int, typer.Option(help="First returns to ask of each program.")] = 10_000,
    out: Annotated[Path | None, typer.Option(help="A folder for bench.md and bench.png.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
) -> None:
    """Race the exact map of vi_pair against the other programs installed here: time and error on the same first returns."""
    from nsmaps.bench import figure, run

    with _told(), _bar(quiet) as progress:
        result = run(returns=returns, progress=progress)
    typer.echo(result.table())
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        (out / "bench.md").write_text(result.table() + "\n", encoding="utf-8")
        typer.echo(f"written to {out / 'bench.md'} and {figure(result, out / 'bench.png')}")


def _draw(result: "StudyResult", folder: Path, format: Format) -> list[Path]:
    from nsmaps.figures import draw

    return draw(result, result.study.figures, folder / "figures", formats=(format.value,))


@contextmanager
def _told(fatal: bool = True) -> Iterator[None]:
    """An error of nsmaps is printed without a traceback, and ends the program if it is fatal; so does Ctrl-C."""
    try:
        yield
    except KeyboardInterrupt:
        typer.echo("stopped; nothing more was written", err=True)
        raise typer.Exit(STOPPED) from None
    except (NsmapsError, OSError) as error:
        typer.echo(str(error), err=True)
        if fatal:
            raise typer.Exit(BAD) from None


@contextmanager
def _bar(quiet: bool) -> Iterator[Callable[[str, int, int], None]]:
    """A progress bar on standard error while it is a terminal; elsewhere nothing at all."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = _console(stderr=True)
    columns = (TextColumn("{task.description:14s}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as bar:
        task = bar.add_task("", total=1)
        yield lambda what, done, total: bar.update(task, description=what, completed=done, total=total)


def _console(stderr: bool = False) -> "Console":
    from rich.console import Console

    console = Console(stderr=stderr, highlight=False)
    return console if console.is_terminal else Console(stderr=stderr, highlight=False, width=WIDE)


def _table(result: "StudyResult") -> None:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table("verdict", "of", "required", "holds", "because", box=box.SIMPLE, title=result.study.title or None)
    for verdict in result.verdicts:
        colour = "green" if verdict.holds else "red" if verdict.required else "yellow"
        holds, _, because = verdict.text.partition(": ")
        required = "yes" if verdict.required else ""
        table.add_row(escape(verdict.name), verdict.of, required, f"[{colour}]{holds}[/]", escape(because))
    _console().print(table)


def _pieces(result: "StudyResult") -> None:
    """The regions that a partition ended with, if there is one."""
    from rich import box
    from rich.table import Table

    if result.partition is None:
        return
    table = Table("region", "role", "word", "share", "order", "terms", "largest error", "", box=box.SIMPLE, title="Partition")
    for row in result.partition.table():
        error = " ".join(f"{value:.2g}" for value in row.max_error)
        share = f"{100 * row.share:.3g} %"
        table.add_row(row.name, row.role, row.word, share, row.order, str(row.terms), error, row.became.partition(":")[0])
    _console().print(table)


def _about(study: "Study", step: str) -> str:
    """What one step of a study would compute, in a few words."""
    if step == "surfaces":
        size = " x ".join(str(span.points) for span in (study.grid or {}).values())
        return f"{', '.join(study.families) or 'words'} over {size} states"
    if step == "composite":
        return ", ".join(f"{p.name} ({_map_of(p)})" for p in study.composite)
    if step == "partition" and study.partition:
        return f"{study.partition.kind}, tolerance {study.partition.tolerance:g}"
    if step == "parametric" and (made := study.parametric):
        return f"order {made.order} in {made.parameter} from {made.low:g} to {made.high:g}"
    if step == "orbits":
        return ", ".join(f"{orbit.returns} returns" for orbit in study.orbits)
    if step == "domains":
        return ", ".join(f"{d.name} (map {d.map}, {d.updates} updates)" for d in study.domains)
    if step == "diagonal" and study.diagonal:
        sweep = study.diagonal.sweep
        over = f" over {sweep.points} values of {sweep.parameter}" if sweep else ""
        return f"{study.diagonal.family} within a factor {study.diagonal.delta:g} of the diagonals{over}"
    if step in ("morse", "transient") and (section := dict(study)[step]):
        return f"{section.cells} cells an axis, halved {section.depth} times"
    return f"of the domain {study.second_iterate.domain}" if study.second_iterate else ""


def _map_of(piece: "PieceSection") -> str:
    """Where the map of a piece comes from."""
    return f"fit of {piece.family}" if piece.fit else "printed" if piece.polynomial else "reset"


def _required(study: "Study") -> list[str]:
    follows = [f"parametric: {claim}" for claim in (study.parametric.require if study.parametric else ())]
    return [*study.require, *follows, *(f"domain {d.name}: {claim}" for d in study.domains for claim in d.require)]


def _first_sentence(text: str | None) -> str:
    return " ".join((text or "no description").split()).split(". ")[0].rstrip(".") + "."


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
