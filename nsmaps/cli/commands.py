"""Commands about files: `nsmaps copy`, `show`, `export`, `schema`, `cite` and `new-plugin`."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from nsmaps.cli.drawing import animate, figures, report
from nsmaps.cli.options import Folder, InstalledOnly, of_run
from nsmaps.cli.terminal import examples, reported_errors, say, summary
from nsmaps.errors import NsmapsError
from nsmaps.exports.languages import LANGUAGES


def add_to(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command(epilog=examples("nsmaps figures runs/vi_pair/fp --only cobweb --format pdf --format svg"))(figures)
    app.command(epilog=examples("nsmaps animate runs/vi_pair/fp cobweb", "nsmaps animate runs/vi_pair/fp surfaces"))(animate)
    app.command(epilog=examples("nsmaps copy vi_pair/pd", "nsmaps copy vi_pair/pd mine.yaml"))(copy)
    app.command(epilog=examples("nsmaps report runs/vi_pair/fp"))(report)
    app.command(epilog=examples("nsmaps show runs/vi_pair/fp", "nsmaps show runs/vi_pair/fp --verdicts | less"))(show)
    exports = examples("nsmaps export runs/vi_pair/fp --to c", "nsmaps export runs/vi_pair/fp --to c --iterate 2 --piece R1+")
    app.command(epilog=exports)(export)
    app.command(epilog=examples("nsmaps new-plugin shaken_ball", "nsmaps new-plugin normal_form --map --into ~/plugins"))(
        new_plugin
    )
    app.command(epilog=examples("nsmaps schema basins", "nsmaps schema --out study.schema.json"))(schema)
    app.command(epilog=examples("nsmaps cite", "nsmaps cite runs/vi_pair/fp >> references.bib"))(cite)


def show(
    folder: Folder,
    verdicts: Annotated[bool, typer.Option("--verdicts", help="Print every verdict with its reasons.")] = False,
    installed_only: InstalledOnly = False,
) -> None:
    """Print the result of a run, also of one that was stopped: headline, main numbers, all tables, counts of verdicts.

    Nothing is computed or written.
    """
    from nsmaps.study.store.archive import read_result

    with of_run(folder):
        result = read_result(folder, installed_only=installed_only)
    summary(result, folder, with_verdicts=verdicts)


def export(
    folder: Folder,
    to: Annotated[str, typer.Option(metavar="FORMAT", help=f"A language: {', '.join(LANGUAGES)}.")],
    out: Annotated[Path | None, typer.Option(help="The folder to write to.", show_default="DIR/export", file_okay=False)] = None,
    iterate: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Write only the N-th iterate of one piece, all coordinates.")
    ] = None,
    piece: Annotated[str | None, typer.Option(help="The piece of --iterate; required if there are several.")] = None,
    installed_only: InstalledOnly = False,
) -> None:
    """Write the maps and closed forms of a run in another language, in C, Julia and JavaScript also the exact map.

    Results without a closed form, such as an envelope whose curves cross, are listed on standard error.
    """
    import nsmaps
    from nsmaps.exports.write import export_iterate, left_out
    from nsmaps.study.store.run_folder import listed

    place = out or folder / "export"
    with of_run(folder):
        if piece is not None and iterate is None:
            raise nsmaps.NsmapsError(f"a piece {piece!r} and no iterate; expected: --iterate N --piece {piece}")
        result = nsmaps.read_result(folder, installed_only=installed_only)
        with listed(folder, place) as beside:
            files = export_iterate(result, iterate, piece, to, beside) if iterate else nsmaps.export(result, to, beside)
        left = [] if iterate else left_out(result, to)
    typer.echo("\n".join(str(place / name) for name in files))
    for line in left:
        say(f"not written: {line}", err=True)


def copy(
    study: Annotated[str, typer.Argument(metavar="STUDY", help="An installed study, such as vi_pair/pd.")],
    to: Annotated[
        Path | None, typer.Argument(metavar="[FILE]", help="The file to write, or its folder.", show_default="<study>.yaml")
    ] = None,
) -> None:
    """Copy a study that an installed system ships, for editing, with the files to which it refers.

    Nothing is overwritten. The copy's first line names the schema that is installed, for editors.
    """
    from nsmaps.study.reading.shipped import copy_study

    with reported_errors():
        paths = copy_study(study, to)
    typer.echo(f"written to {', '.join(map(str, paths))}\nto run it: {shlex.join(['nsmaps', 'run', str(paths[0])])}")


def new_plugin(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the system: small letters, digits and _.")],
    into: Annotated[Path, typer.Option(help="The folder for the folder of the project.", file_okay=False)] = Path(),
    hybrid: Annotated[bool, typer.Option("--hybrid", help="Write a system with modes instead of an impact system.")] = False,
    formulas: Annotated[bool, typer.Option("--map", help="Write a map given by formulas instead of an impact system.")] = False,
) -> None:
    """Write a project for a system of your own: class, study, test and pyproject."""
    from nsmaps.cli.newplugin import new_plugin

    with reported_errors():
        if hybrid and formulas:
            raise NsmapsError("--hybrid and --map name two kinds of systems; expected: one of them")
        folder = new_plugin(name, into, "map" if formulas else "hybrid" if hybrid else "impacts")
    typer.echo(f'written to {folder}; next: pip install -e "{folder}[test]" && nsmaps run {name}/first && pytest "{folder}"')


def schema(
    section: Annotated[
        str | None, typer.Argument(metavar="[SECTION]", help="Print the keys of this section instead.", show_default=False)
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Write the schema to a file, and print the line by which a study names it.", dir_okay=False),
    ] = None,
) -> None:
    """Print the JSON Schema of studies, by which an editor completes keys, shows their meaning, and marks errors.

    With SECTION the keys of that section are printed, with their types, defaults and meanings; `study` is the study as a whole.
    """
    from importlib.resources import files

    from nsmaps.study.reading.shipped import MODELINE
    from nsmaps.study.schema import table_of, with_installed

    if section is not None:
        with reported_errors():
            say(str(table_of(section)))
        return
    text = with_installed(files("nsmaps.study").joinpath("schema.json").read_text(encoding="utf-8"))
    if out is None:
        typer.echo(text, nl=False)
        return
    with reported_errors():
        out.write_text(text, encoding="utf-8")
    typer.echo(f"written to {out}; the first line of a study beside it:\n{MODELINE}{out.name}")


def cite(
    folder: Annotated[
        Path | None, typer.Argument(metavar="[DIR]", help="The folder of a run, to be cited as well.", show_default=False)
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
