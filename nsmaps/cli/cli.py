"""The command line of nsmaps.

`nsmaps systems | check STUDY | run STUDY | copy STUDY | figures DIR | animate DIR | report DIR | show DIR | explore DIR |
export DIR | prove STUDY | verify FILE | new-plugin NAME | schema | cite | bench`.

Exit codes: 0 done, 1 a required verdict fails, 2 the study or the command cannot be read, a figure not be drawn or the output
not be written, 130 stopped by Ctrl-C, 141 broken pipe.
Nothing heavy is imported before a command needs it.
"""

import os
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from nsmaps.cli import commands, exploring, proving
from nsmaps.cli.drawing import Drawn, draw_listed, say_undrawn
from nsmaps.cli.options import InstalledOnly, MaxHours, MaxMemory, Settings, command_again
from nsmaps.cli.terminal import BAD, FAILED, Program, examples, progress_line, say, show_markdown, summary, written
from nsmaps.cli.terminal import reported_errors as _reported_errors
from nsmaps.progress import working

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult
    from nsmaps.study.study import Study


def _studies(beginning: str) -> list[str]:
    """The installed studies whose name begins so, for the shell to complete."""
    from nsmaps import plugins

    return [name for name in plugins.study_names() if name.startswith(beginning)]


app = typer.Typer(
    cls=Program,
    help="Dynamics of systems with impacts, modes and other breaks: a YAML study in; bifurcation diagrams, basins, branches, "
    "parameter planes and enclosed attracting domains out, with figures and a report.",
    epilog=examples("nsmaps systems", "nsmaps run vi_pair/fp", "nsmaps run --help"),
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)
StudyName = Annotated[
    str, typer.Argument(metavar="STUDY", help="A YAML file, or an installed study such as vi_pair/fp.", autocompletion=_studies)
]

GIVEN = dict(os.environ)  #: the environment with which the program was started


def main() -> None:
    """The console entry point. NumPy, not loaded yet, is to keep to one core: threads slow its many small problems.

    A warning is a line, without the source that gives it. Objects that refer to one another are looked for when 100,000 have been
    made, not 700: imports and figures make many that stay. At the end they are not looked for once more.
    """
    import atexit
    import gc
    import warnings

    gc.set_threshold(100_000, 20, 100)
    atexit.register(gc.freeze)

    warnings.formatwarning = lambda message, category, *_, **__: f"{category.__name__}: {message}\n"
    for library in ("OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    with written():
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


@app.command(epilog=examples("nsmaps systems"))
def systems() -> None:
    """List the installed systems, their parameters and their studies."""
    import warnings

    from nsmaps import plugins

    names = plugins.system_names()
    for name in names:
        with _reported_errors(fatal=False), warnings.catch_warnings():
            cls = plugins.system_class(name)
            say(f"{name}: {_first_sentence(cls.__doc__)}")
            for parameter, field in cls.model_fields.items():
                default = "" if field.is_required() else f" (default {field.default})"
                say(f"  {parameter:8s} {field.description or ''}{default}")
            for quantity, description in cls.instead.items():
                say(f"  {quantity:8s} {description}")
            say(f"  studies: {', '.join(f'{name}/{stem}' for stem in plugins.study_files(name)) or 'none'}")
    if not names:
        say("no system is installed; install a package that gives one, or name a file: path/to/mine.py:Class")


@app.command(epilog=examples("nsmaps check vi_pair/fp", "nsmaps check mine.yaml", "nsmaps check vi_pair/pd --set r=0.45"))
def check(
    study: StudyName,
    set_: Settings = None,
    installed_only: InstalledOnly = False,
    max_memory: MaxMemory = None,
    max_hours: MaxHours = None,
) -> None:
    """Read a study and print what a run would compute, without computing it.

    A study with a class in a file is checked against that class; a warning that the file is executed comes first.

    The memory and time of a run are estimated, and refused beyond a limit, as in a run. `nsmaps schema SECTION` prints the keys
    of a section.

    Each error is reported on one line with file, line, column, what is expected and a near match; the exit code is then 2.
    Formulas of the system that are inconsistent, such as a displacement that does not start at its impact, are errors too.
    """
    from nsmaps.plugins import is_file
    from nsmaps.study.conclusions.summary import about
    from nsmaps.study.limits import check_sizes, total
    from nsmaps.study.reading.overrides import assignments
    from nsmaps.study.reading.reader import found_study, made_ready

    with _reported_errors():
        read = found_study(study, installed_only)
        for loc, name in read.classes().items():
            of = "the system" if loc == ("system",) else "a quantifier" if "quantifiers" in loc else "a class"
            if is_file(name) and os.path.isfile(name.rpartition(":")[0]):
                say(f"executes {name}, the file of {of}, with your permissions; --installed-only refuses it", err=True)
        read = made_ready(read, assignments(set_ or []))
        with read.source.located(("system",)):
            system = read.system_object()
            system.check_formulas()
        needs = check_sizes(read, system, max_memory, max_hours)
    say(f"{read.name}: {read.title}" if read.title else read.name)
    given = ", ".join(f"{name} = {_short(value)}" for name, value in read.parameters.items())
    say(f"  system: {read.system} ({given or 'parameters as they come'}); states ({', '.join(system.coordinates)})")
    for name, text in about(read).items():
        say(f"  {name}{text and ': '}{text}")
    if read.figures:
        say(f"  figures: {', '.join(read.figures)}")
    say(f"  required: {', '.join(_required(read)) or 'no verdict'}")
    without = ", ".join(name for name, size in needs.items() if size is None)
    say(f"  estimated, to a factor of ten: {total(needs).text()}{f', and what {without} needs' if without else ''}")


@app.command(
    epilog=examples(
        "nsmaps run vi_pair/fp",
        "nsmaps run vi_pair/pd --set r=0.45",
        "nsmaps run mine.yaml --out results",
        "nsmaps run mine.yaml --out results --resume",
    )
)
def run(
    context: typer.Context,
    study: StudyName,
    set_: Settings = None,
    out: Annotated[
        Path | None, typer.Option(help="The folder to write to.", show_default="runs/<study>", file_okay=False)
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw no figures.")] = False,
    no_report: Annotated[bool, typer.Option("--no-report", help="Write no report.html.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Resume a run of the same study that was stopped.")] = False,
    workers: Annotated[int, typer.Option(metavar="N", min=1, help="Number of processes; the numbers computed are the same.")] = 1,
    installed_only: InstalledOnly = False,
    max_memory: MaxMemory = None,
    max_hours: MaxHours = None,
    style: Drawn = None,
) -> None:
    """Compute what a study names, write it to a folder, and end with its result in a few lines.

    The folder holds report.html, which shows all of it in a browser, and the numbers and arrays for programs. Ctrl-C keeps
    the steps that are finished. The exit code is 0 if every required verdict holds, 1 if one fails, 2 if the study cannot be
    read or a figure not be drawn, 130 after Ctrl-C.
    """
    with _reported_errors(), progress_line(quiet):
        from nsmaps.cli.workers import processes, resumable
        from nsmaps.study.reading.overrides import assignments
        from nsmaps.study.reading.reader import load_study
        from nsmaps.study.run import run_study

        read = load_study(study, assignments(set_ or []), installed_only=installed_only)
        folder = out or Path("runs", read.name)
        again = command_again(context, out=folder, resume=True)
        with processes(workers) as executor, resumable(again, folder):
            result = run_study(read, folder, resume=resume, max_memory=max_memory, max_hours=max_hours, executor=executor)
        with resumable(again, folder, result.timings):
            result = _shown(result, folder, not no_figures, not no_report, style or "")
    if not quiet:
        summary(result, folder, whole=False)
    if not result.holds:
        raise typer.Exit(FAILED)
    if result.undrawn and not no_figures:
        raise typer.Exit(BAD)


@app.command(epilog=examples("nsmaps bench --returns 2000", "nsmaps bench --start"))
def bench(
    returns: Annotated[int, typer.Option(help="Number of first returns that each program computes.")] = 10_000,
    start: Annotated[
        bool, typer.Option("--start", help="Measure the time to a first result instead; takes some minutes.")
    ] = False,
    out: Annotated[Path | None, typer.Option(help="A folder for bench.md and bench.png, or for start.md.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
) -> None:
    """Compare the exact map of vi_pair with other installed programs: time and error on the same first returns."""
    from nsmaps.bench import BenchResult, figure, run
    from nsmaps.bench import start as take

    with _reported_errors(), progress_line(quiet):
        result = take(environment=GIVEN) if start else run(n_returns=returns)
    show_markdown(result.table())
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        table = out / ("start.md" if start else "bench.md")
        table.write_text(result.table() + "\n", encoding="utf-8")
        drawn = f" and {figure(result, out / 'bench.png')}" if isinstance(result, BenchResult) else ""
        say(f"written to {table}{drawn}")


def _shown(result: "StudyResult", folder: Path, figures: bool, report: bool, style: str = "") -> "StudyResult":
    """The result, with the time that its figures took if they are drawn; its report is written, too."""
    from nsmaps.study.pictures.catalogue import named_by
    from nsmaps.study.store.archive import amend

    if figures and (names := named_by(result)):
        begun = perf_counter()
        with working("figures"):
            result = draw_listed(result, names, folder, first=True, style=style)[1]
        result = replace(result, timings={**result.timings, "figures": perf_counter() - begun})
        amend(result, folder)
        say_undrawn(result, names)
    if report:
        from nsmaps.report.page import write_report

        with working("report"):
            write_report(result, folder)
    return result


def _required(study: "Study") -> list[str]:
    follows = [f"parametric_map: {claim}" for claim in (study.parametric_map.require if study.parametric_map else ())]
    return [
        *study.require,
        *follows,
        *(f"domain {d.name}: {claim.replace('_', ' ')}" for d in study.domains for claim in d.require),
    ]


def _first_sentence(text: str | None) -> str:
    return " ".join((text or "no description").split()).split(". ")[0].rstrip(".") + "."


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


commands.add_to(app)
app.command(epilog=exploring.EXAMPLES)(exploring.explore)
app.command(epilog=proving.PROVE)(proving.prove)
app.command(epilog=proving.VERIFY)(proving.verify)
