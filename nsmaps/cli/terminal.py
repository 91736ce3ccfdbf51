"""What commands share: how they end, how they show progress, and the tables that they print.

Escape codes go to a terminal only, and colours not where NO_COLOR is set; what goes to a file or a pipe is plain text.
"""

import os
import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperGroup

from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from nsmaps.study.result import StudyResult
    from nsmaps.study.sections.base import Table as SectionTable

FAILED, BAD, STOPPED, UNREAD = 1, 2, 130, 141  #: exit codes: a required verdict fails, what cannot be read, Ctrl-C, broken pipe
NARROW = 160  #: columns of a terminal up to which what verdicts say stands below their names, in the whole width
SOON = 0.3  #: seconds after which a command shows its progress
WIDE = 200  #: columns of a table that goes to a file or a pipe, without the variable COLUMNS
LINES = 24  #: at most, at the end of a run
KEY_NUMBERS = 5  #: at most, there


def examples(*lines: str) -> str:
    """Commands to be tried, in Markdown, below a command's help."""
    return "Examples:\n\n" + "  \n".join(f"$ {line}" for line in lines)


@contextmanager
def reported_errors(fatal: bool = True) -> Iterator[None]:
    """An error of nsmaps is printed without a traceback, and ends the program if it is fatal; so does Ctrl-C.

    A fatal error of the operating system, as of a file, is reported too; one that is not fatal concerns the output (`written`).
    """
    try:
        yield
    except KeyboardInterrupt:
        typer.echo("stopped; nothing more was written", err=True)
        raise typer.Exit(STOPPED) from None
    except (NsmapsError, OSError) as error:
        if isinstance(error, BrokenPipeError) or not (fatal or isinstance(error, NsmapsError)):
            raise
        parts = (error.filename, error.strerror) if isinstance(error, OSError) and error.strerror else (error,)
        say(": ".join(str(part) for part in parts if part is not None), err=True)
        if fatal:
            raise typer.Exit(BAD) from None


@contextmanager
def written() -> Iterator[None]:
    """Where the output cannot be written the program ends: silently for a broken pipe, else with an error."""
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
    """The commands; each ends where its output cannot be written. Help shows no type of an option that is a flag."""

    def get_params(self, ctx: Any) -> Any:
        """The options of the program itself."""
        return _flags_without_type(TyperGroup.get_params(self, ctx))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name, None if there is none."""
        command = TyperGroup.get_command(self, ctx, cmd_name)
        _flags_without_type(command.get_params(ctx) if command else ())
        return command

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for."""
        with written():
            return TyperGroup.invoke(self, ctx)


def _flags_without_type(options: Any) -> Any:
    for option in options:
        if getattr(option, "is_bool_flag", False):
            option.metavar = ""
    return options


def progress_line(quiet: bool) -> AbstractContextManager[None]:
    """The progress of long calls on one line of standard error while that is a terminal; no line if `quiet`."""
    from nsmaps.progress import display, silent

    return silent() if quiet else display(SOON)


def console(stderr: bool = False) -> "Console":
    """A console as wide as the terminal or as COLUMNS says, or else wide enough for a table in a file."""
    from rich.console import Console

    screen = Console(stderr=stderr, highlight=False)
    return screen if screen.is_terminal or _columns_given() else Console(stderr=stderr, highlight=False, width=WIDE)


def _columns_given() -> bool:
    """Whether the environment states a width, which then holds for files and pipes too."""
    return os.environ.get("COLUMNS", "").isdigit()


def say(text: str, err: bool = False) -> None:
    """Print text; on a terminal its lines are broken between words, and continue where they began.

    So they are in a file or a pipe where COLUMNS says how wide it is, apart from errors, which programs read.
    """
    typer.echo("\n".join(_lines(text, err)), err=err)


def _lines(text: str, err: bool = False) -> list[str]:
    """The lines of a text as they are printed."""
    lines = text.split("\n")
    if not (sys.stderr.isatty() if err else sys.stdout.isatty() or _columns_given()):
        return lines
    width = console(err).width
    return [part for line in lines for part in _broken(line, width)]


def _broken(line: str, width: int) -> list[str]:
    """A line of text as lines of a width at most, unless a word is longer."""
    indent = line[: len(line) - len(line.lstrip())]
    more = indent + "  " * bool(indent)
    return wrap(line, width, subsequent_indent=more, break_long_words=False, break_on_hyphens=False) or [line]


def summary(result: "StudyResult", folder: Path, whole: bool = True, with_verdicts: bool = False) -> None:
    """Print the results of a run: the headline, its main numbers, tables, counts of verdicts, and where picture and report are.

    Args:
        result: of the run.
        folder: where it was written.
        whole: print every table; without it those that `LINES` lines have room for, in their order.
        with_verdicts: print every verdict.
    """
    from nsmaps.report.pictures import key_picture
    from nsmaps.study.conclusions.headline import headline, key_numbers
    from nsmaps.study.conclusions.summary import tables
    from nsmaps.study.conclusions.verdict import conclusion

    picture = key_picture(result, folder)
    places = {"picture": picture.path} if picture else {}
    places |= {"report": folder / "report.html", "data": folder / "result.json"}
    given = [f"{name:8}{path}" for name, path in places.items() if path.is_file()]
    more = [] if whole else [f"All tables: nsmaps show {shlex.quote(str(folder))}; all verdicts: with --verdicts."]
    begin = "\n\n".join(filter(None, (result.study.title or result.study.name, headline(result))))
    above = [*_lines(begin), ""]
    failed = [verdict for verdict in result.verdicts if verdict.required and not verdict.holds]
    reasons = [f"  {each.name}: {each.text.partition(': ')[2]}" for each in failed]
    below = _lines("\n".join([f"{conclusion(result)}", *reasons, *more, "", *given]))
    room = LINES - len(above) - len(below)
    rows = [_aligned(key_numbers(result, count)) for count in range(KEY_NUMBERS, 0, -1)]
    above += next((lines for lines in rows if whole or len(lines) <= room), [])
    printed, room = list[str](), LINES - len(above) - len(below)
    for table in tables(result):
        lines = table_lines(table)
        if whole or len(printed) + len(lines) <= room:
            printed += lines
    verdicts = verdict_lines(result) if with_verdicts else []
    typer.echo("\n".join([*above, *printed, *verdicts, *below]))


def _aligned(numbers: Sequence[tuple[str, str]]) -> list[str]:
    """Numbers with their meanings in two columns, and a blank line; the meaning of a long one stands below it."""
    width, lines = console().width, list[str]()
    wide = max((len(value) for value, _ in numbers if len(value) <= width // 3), default=0) + 2
    for value, meaning in numbers:
        texts = wrap(meaning, max(width - wide - 2, wide), break_long_words=False)
        if len(value) < wide:
            lines.append(f"  {value:{wide}}{texts.pop(0)}")
        else:
            lines += _broken(f"  {value}", width)
        lines += [f"  {'':{wide}}{text}" for text in texts]
    return [*lines, ""] if lines else []


def _shown(table: "Table") -> list[str]:
    """The lines of a table, to be printed as all other text, so that an output that cannot be written is reported once."""
    screen = console()
    with screen.capture() as caught:
        screen.print(table)
    return [line.rstrip() for line in caught.get().split("\n")][:-1]


def show_table(section_table: "SectionTable") -> None:
    """Print a table of a section, and the lines below it."""
    typer.echo("\n".join(table_lines(section_table)))


def table_lines(section_table: "SectionTable") -> list[str]:
    """The lines of a table of a section, and those below it; one without rows is its lines under its title.

    On a terminal on which a word of it would be broken each row is a paragraph.
    """
    from rich import box
    from rich.markup import escape
    from rich.measure import Measurement
    from rich.table import Table

    screen, lines = console(), list[str]()
    if section_table.rows:
        columns = [column for column in zip(section_table.heads, *section_table.rows, strict=True) if any(column)]
        heads, *rows = zip(*columns, strict=True)
        table = Table(box=box.SIMPLE)
        for column in columns:
            table.add_column(column[0], min_width=max(len(word) for cell in column for word in [*cell.split(), ""]))
        for row in rows:
            table.add_row(*map(escape, row))
        if Measurement.get(screen, screen.options, table).minimum < screen.width:
            lines += [*_lines(section_table.title), *_shown(table)]
        else:
            lines += _lines("\n".join([section_table.title, "", *(_paragraph(heads, row) for row in rows), ""]))
    elif section_table.title and section_table.notes:
        lines += _lines(f"{section_table.title}\n")
    return [*lines, *(_lines("\n".join([*section_table.notes, ""])) if section_table.notes else [])]


def _paragraph(heads: Sequence[str], row: Sequence[str]) -> str:
    """A row of a table as text."""
    said = [f"{' '.join(head.split())} {' '.join(cell.split())}".strip() for head, cell in zip(heads, row, strict=True) if cell]
    return f"  {'; '.join(said)}"


def show_markdown(text: str) -> None:
    """Print a text with one table in Markdown, as it is unless it goes to a terminal."""
    from nsmaps.study.sections.base import Table

    lines = text.split("\n")
    rows = [tuple(cell.strip() for cell in line.strip("| ").split("|")) for line in lines if line.startswith("|")]
    if not (sys.stdout.isatty() and rows):
        typer.echo(text)
        return
    show_table(Table("", rows[0], tuple(rows[2:]), tuple(line for line in lines if not line.startswith("|"))))


def verdict_lines(result: "StudyResult") -> list[str]:
    """The lines of a table of every verdict, if there is any; on a narrow terminal what it says below its name."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    narrow = console().width <= NARROW
    heads = ("holds", "verdict") if narrow else ("verdict", "of", "required", "holds", "because")
    table = Table(*heads, box=box.SIMPLE)
    for verdict in result.verdicts:
        colour = "green" if verdict.holds else "red" if verdict.required else "yellow"
        text, _, because = verdict.text.partition(": ")
        holds, required = f"[{colour}]{text}[/]", "yes" if verdict.required else ""
        name, map_name, because = map(escape, (verdict.name, verdict.of, because))
        text_below = f"[bold]{name}[/] ({map_name}{', required' * verdict.required})\n{because}"
        table.add_row(*((holds, text_below) if narrow else (name, map_name, required, holds, because)))
    return ["Verdicts", *_shown(table)] if table.rows else []
