"""Arguments and options that several commands have."""

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from nsmaps.cli.terminal import reported_errors
from nsmaps.errors import NsmapsError

InstalledOnly = Annotated[
    bool, typer.Option("--installed-only", help="Refuse a study whose system is a class in a file, which would be executed.")
]
MaxMemory = Annotated[
    float | None,
    typer.Option(
        metavar="GB",
        help="Limit of the estimated memory in gigabytes; by default NSMAPS_MAX_MEMORY, or that of the machine.",
        show_default=False,
    ),
]
MaxHours = Annotated[
    float | None,
    typer.Option(
        metavar="HOURS",
        help="Limit of the estimated hours on one core; by default NSMAPS_MAX_HOURS, or 24.",
        show_default=False,
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="A parameter in place of the study's own, such as r=0.45; may be repeated."),
]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A folder that `nsmaps run` wrote.")]


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
            raise NsmapsError(f"{folder} is not as `nsmaps run` writes it ({why}); expected: a run of this version") from error


def command_again(context: typer.Context, **instead: object) -> str:
    """The command line of a command with the options that it was given, some of them replaced or added."""
    words = ["nsmaps", str(context.info_name)]
    for each in context.command.params:
        source = context.get_parameter_source(str(each.name))
        given = context.params.get(str(each.name)) if source is not None and source.name == "COMMANDLINE" else None
        value = instead.get(str(each.name), given)
        option = [each.opts[0]] if each.opts[0].startswith("-") else []
        for one in value if isinstance(value, list | tuple) else [value] if value not in (None, False) else []:
            words += option if one is True else [*option, str(one)]
    return shlex.join(words)
