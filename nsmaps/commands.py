"""Commands about files: `nsmaps report`, `nsmaps export`, `nsmaps schema`, `nsmaps cite`, `nsmaps new-plugin`."""

from pathlib import Path
from typing import Annotated

import typer

from nsmaps.terminal import examples, told

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A folder that `nsmaps run` wrote.")]
MODELINE = "# yaml-language-server: $schema="


def add_to(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(epilog=examples("nsmaps report runs/vi_pair/fp"))(report)
    app.command(epilog=examples("nsmaps export runs/vi_pair/fp --to c", "nsmaps export DIR --to latex --out tex"))(export)
    app.command(epilog=examples("nsmaps new-plugin shaken_ball", "nsmaps new-plugin shaken_ball --into ~/plugins"))(new_plugin)
    app.command(epilog=examples("nsmaps schema --out study.schema.json", "nsmaps schema | less"))(schema)
    app.command(epilog=examples("nsmaps cite", "nsmaps cite runs/vi_pair/fp >> references.bib"))(cite)


def report(folder: Folder) -> None:
    """Write report.html of a run again: verdicts, what was asked, figures, numbers, timings, versions, how to cite.

    It is one file that needs nothing but a browser, on a phone or on paper too. It holds the figures that are in the folder now.
    """
    from nsmaps.report.page import write_report
    from nsmaps.study.archive import read_result

    with told():
        path = write_report(read_result(folder), folder)
    typer.echo(str(path))


def export(
    folder: Folder,
    to: Annotated[str, typer.Option(metavar="FORMAT", help="latex, python, c, julia, matlab or json.")],
    out: Annotated[Path | None, typer.Option(help="The folder to write to.", show_default="DIR/export", file_okay=False)] = None,
) -> None:
    """Write the maps and closed forms of a run in another language."""
    import nsmaps

    with told():
        files = nsmaps.export(nsmaps.read_result(folder), to, place := out or folder / "export")
    typer.echo("\n".join(str(place / name) for name in files))


def new_plugin(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the system: small letters, digits and _.")],
    into: Annotated[Path, typer.Option(help="The folder in which the project's own folder is made.", file_okay=False)] = Path(),
) -> None:
    """Write a little project for a system of your own: class, study, test and pyproject."""
    from nsmaps.newplugin import new_plugin

    with told():
        folder = new_plugin(name, into)
    typer.echo(f"written to {folder}; next: pip install -e {folder} && nsmaps run {name}/first")


def schema(
    out: Annotated[Path | None, typer.Option(help="Write it to a file, and say how a study names it.", dir_okay=False)] = None,
) -> None:
    """Print the JSON Schema of studies, by which an editor completes keys, says what they mean, and marks what is wrong.

    An editor with a YAML language server reads it by the first line of a study, which names the schema's file.
    """
    from importlib.resources import files

    text = files("nsmaps.study").joinpath("schema.json").read_text(encoding="utf-8")
    if out is None:
        typer.echo(text, nl=False)
        return
    with told():
        out.write_text(text, encoding="utf-8")
    typer.echo(f"written to {out}; the first line of a study beside it:\n{MODELINE}{out.name}")


def cite(
    folder: Annotated[
        Path | None, typer.Argument(metavar="[DIR]", help="A run's folder, to be cited too.", show_default=False)
    ] = None,
) -> None:
    """Print BibTeX of the software, of the paper whose method it implements, and of a run."""
    import nsmaps
    from nsmaps.report.cite import citation, run_citation

    entries = citation(nsmaps.__version__)
    if folder is not None:
        from nsmaps.study.archive import read_result

        with told():
            result = read_result(folder)
            entries = citation(result.versions["nsmaps"])
            entries += "\n" + run_citation(result.study.name, result.study.title, result.versions, folder)
    typer.echo(entries)
