"""What commands share: how they end, how they show progress, and the tables that they print.

Escape codes go to a terminal only, and colours not where NO_COLOR is set; what goes to a file or a pipe is plain text.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from time import perf_counter
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperGroup

from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from nsmaps.study.result import StudyResult

FAILED, BAD, STOPPED, UNREAD = 1, 2, 130, 141  #: exit codes: a required verdict fails, what cannot be read, Ctrl-C, broken pipe
ROWS = 12  #: of a table of a diagram's motions, at most, of each map
NARROW = 160  #: columns of a terminal up to which what verdicts say stands below their names, in the whole width
WIDE = 200  #: columns of a table that goes to a file or a pipe


def examples(*lines: str) -> str:
    """Commands to be tried, in Markdown, below a command's help."""
    return "Examples:\n\n" + "  \n".join(f"$ {line}" for line in lines)


@contextmanager
def told(fatal: bool = True) -> Iterator[None]:
    """An error of nsmaps is printed without a traceback, and ends the program if it is fatal; so does Ctrl-C.

    An error of the system, as of a file, is told too where it is fatal; where it is not, it is of the output (`written`).
    """
    try:
        yield
    except KeyboardInterrupt:
        typer.echo("stopped; nothing more was written", err=True)
        raise typer.Exit(STOPPED) from None
    except (NsmapsError, OSError) as error:
        if isinstance(error, BrokenPipeError) or not (fatal or isinstance(error, NsmapsError)):
            raise
        typer.echo(str(error), err=True)
        if fatal:
            raise typer.Exit(BAD) from None


@contextmanager
def written() -> Iterator[None]:
    """Where the output cannot be written the program ends: silently if nobody reads on, else with an error."""
    try:
        yield
        sys.stdout.flush()
    except OSError as error:
        with suppress(OSError):  # what is left to be written goes nowhere, so that it is not tried again at the end
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            raise SystemExit(UNREAD) from None
        typer.echo(f"the output cannot be written: {error.strerror or error}", err=True)
        raise SystemExit(BAD) from None


class Program(TyperGroup):
    """The commands, of which none goes on where its output cannot be written."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for."""
        with written():
            return TyperGroup.invoke(self, ctx)


@contextmanager
def bar(quiet: bool) -> Iterator[Callable[[str, float, int], None]]:
    """A progress bar on standard error while it is a terminal; elsewhere nothing at all.

    The time left is that of the step: the share of it that is done tells nothing about the steps that follow.
    """
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from nsmaps.progress import silent

    screen = console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TextColumn("{task.fields[left]}"))
    with Progress(*columns, console=screen, transient=True, disable=quiet or not screen.is_terminal) as shown, silent():
        task = shown.add_task("", total=None, left="")
        step, since = "", perf_counter()

        def progress(what: str, done: float, total: int) -> None:
            nonlocal step, since
            if what != step:
                step, since = what, perf_counter()
            share = done - int(done)
            left = f"{clock((perf_counter() - since) * (1 - share) / share)} left of {what}" if share else ""
            number = min(int(done) + 1, total)
            shown.update(task, description=f"{what} ({number} of {total})", completed=done, total=total, left=left)

        yield progress


def clock(seconds: float) -> str:
    """A time as minutes and seconds, with hours where it has any.

    >>> clock(7.2), clock(3725)
    ('0:08', '1:02:05')
    """
    whole = -int(-seconds // 1)
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"


def console(stderr: bool = False) -> "Console":
    """A console as wide as the terminal, or wide enough for a table in a file."""
    from rich.console import Console

    made = Console(stderr=stderr, highlight=False)
    return made if made.is_terminal else Console(stderr=stderr, highlight=False, width=WIDE)


def summary(result: "StudyResult") -> None:
    """Print what a run found: in plain words, its tables, what its orbits end on, its verdicts, and what they come to."""
    from nsmaps.study.conclusion import conclusion
    from nsmaps.study.headline import headline

    typer.echo(f"{result.study.title or result.study.name}\n")
    if told := headline(result):
        typer.echo(f"{told}\n")
    piece_table(result)
    transient_table(result)
    motion_table(result)
    basin_table(result)
    exponent_table(result)
    event_table(result)
    verdict_table(result)
    typer.echo(f"{conclusion(result)}\n")


def _show(table: "Table") -> None:
    """A table, printed as all other text is, so that what cannot be written is told once."""
    screen = console()
    with screen.capture() as caught:
        screen.print(table)
    typer.echo("\n".join(line.rstrip() for line in caught.get().split("\n")), nl=False)


def verdict_table(result: "StudyResult") -> None:
    """Print every verdict, if there is any; on a narrow terminal what it says below its name."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    narrow = console().width <= NARROW
    heads = ("holds", "verdict") if narrow else ("verdict", "of", "required", "holds", "because")
    table = Table(*heads, box=box.SIMPLE, title="Verdicts")
    for verdict in result.verdicts:
        colour = "green" if verdict.holds else "red" if verdict.required else "yellow"
        text, _, because = verdict.text.partition(": ")
        holds, required = f"[{colour}]{text}[/]", "yes" if verdict.required else ""
        name, of, because = map(escape, (verdict.name, verdict.of, because))
        told = f"[bold]{name}[/] ({of}{', required' * verdict.required})\n{because}"
        table.add_row(*((holds, told) if narrow else (name, of, required, holds, because)))
    if table.rows:
        _show(table)


def transient_table(result: "StudyResult") -> None:
    """Print what is left of each region, and how complete the search for cycles is, if the study asks for it."""
    if result.transient is not None:
        typer.echo(f"Transient regions of the {result.transient.of}, by enclosure\n\n{result.transient.table()}\n")
    if result.cycles is not None:
        typer.echo(f"{result.cycles.coverage}\n")


def motion_table(result: "StudyResult") -> None:
    """Print which motion each map of a bifurcation diagram has over which interval of the parameter: the widest intervals."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    from nsmaps.study.motions import NONE, digits, widest

    section = result.study.bifurcation
    if section is None or not result.bifurcation:
        return
    table = Table("map", "motion", f"{section.parameter} from", "to", "values", box=box.SIMPLE, title="Motions")
    every = {label for made in result.bifurcation.values() for label in made.labels.ravel().tolist()}
    told = f"C: no period up to {section.returns // 2} returns: chaos, a longer period, or a motion that has not settled yet."
    notes = [told] if any(label.endswith("C") for label in every) else []
    for of, made in result.bifurcation.items():
        rows, more, largest = widest(made, ROWS)
        for row in rows:
            table.add_row(of, escape(row["label"] or NONE), *digits([row["from"], row["to"]], made), str(row["values"]))
        each = f"{largest} values" if largest > 1 else "one value"
        notes += [f"Of the {of} map there are {more} more intervals, of at most {each}."] if more else []
    _show(table)
    typer.echo("\n".join([*notes, ""]))


def basin_table(result: "StudyResult") -> None:
    """Print which attractors the states of the grid come to, and how many of them to each, if the study asks for it."""
    from rich import box
    from rich.table import Table

    from nsmaps.study.longtables import basin_rows

    made, section = result.basins, result.study.basins
    if made is None or section is None:
        return
    title = f"Basins of the exact map, of {len(made.label)} states of the grid"
    far = "to boundary" if result.boundary is not None else ""
    table = Table("attractor", "period", "words", "share", "within", far, box=box.SIMPLE, title=title)
    for row in basin_rows(made, result.boundary, section.returns):
        table.add_row(*row)
    _show(table)
    told = "within: returns after which every state of the share has come to it"
    typer.echo(f"{told}; to boundary: the attractor's least distance from it.\n" if far else f"{told}.\n")


def exponent_table(result: "StudyResult") -> None:
    """Print over which intervals the largest Lyapunov exponent is above or below zero, those with most values."""
    from rich import box
    from rich.table import Table

    from nsmaps.study.longtables import exponent_rows

    made, section = result.lyapunov, result.study.lyapunov
    if made is None or section is None:
        return
    heads = "largest exponent", f"{section.parameter} from", "to", "values", "a return"
    table = Table(*heads, box=box.SIMPLE, title="Lyapunov exponents of the exact map")
    rows = exponent_rows(made)
    most = sorted(sorted(range(len(rows)), key=lambda k: -rows[k]["values"])[:ROWS])
    for row in (rows[k] for k in most):
        table.add_row(row["sign"], *(f"{row[end]:.9g}" for end in ("from", "to")), str(row["values"]), row["exponent"])
    _show(table)
    more = f" There are {len(rows) - ROWS} more intervals, with fewer values." if len(rows) > ROWS else ""
    typer.echo(f"Above zero: nearby orbits part, as in chaos. Told by two standard errors, of {made.at.returns} returns.{more}\n")


def event_table(result: "StudyResult") -> None:
    """Print what happens on the branches of the study, to the digits that are known of it."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    from nsmaps.study.longsummary import known

    table = Table("branch", "motion", "event", "parameter", "precision", "", box=box.SIMPLE, title="Events on branches")
    names = {section.name: section.parameter for section in result.study.branches}
    for name, made in result.branches.items():
        for event in (event for branch in made for event in branch.events):
            value = f"{names[name]} = {known(event)}"
            table.add_row(escape(name), event.orbit.label, event.kind, value, f"{event.precision:.1g}", escape(event.detail))
    if table.rows:
        _show(table)


def piece_table(result: "StudyResult") -> None:
    """Print the regions that a partition ended with, if there is one."""
    from rich import box
    from rich.table import Table

    if result.partition is None:
        return
    error = "largest error of " + ", ".join(f"{name}'" for name in result.system.coordinates)
    table = Table("region", "role", "word", "share", "order", "terms", error, "", box=box.SIMPLE, title="Partition")
    for row in result.partition.table():
        largest = " ".join(f"{value:.2g}" for value in row.max_error)
        share = f"{100 * row.share:.3g} %"
        table.add_row(row.name, row.role, row.word, share, row.order, str(row.terms), largest, row.became.partition(":")[0])
    _show(table)
