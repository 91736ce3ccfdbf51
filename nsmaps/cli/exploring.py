"""The command `nsmaps explore`: an offline page of a run, or a live page of a study."""

from pathlib import Path
from typing import Annotated

import typer

from nsmaps.cli.options import InstalledOnly
from nsmaps.cli.terminal import examples, progress_line, reported_errors
from nsmaps.errors import NsmapsError

EXAMPLES = examples("nsmaps run vi_pair/explore", "nsmaps explore runs/vi_pair/explore", "nsmaps explore vi_pair/fp --live")


def explore(
    what: Annotated[str, typer.Argument(metavar="DIR|STUDY", help="A folder that `nsmaps run` wrote; with --live a study too.")],
    live: Annotated[bool, typer.Option("--live", help="Serve a page that computes while it is used, until Ctrl-C.")] = False,
    port: Annotated[int, typer.Option(help="Of --live: the port, 0 for any that is free.")] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Of --live: do not open a browser.")] = False,
    out: Annotated[Path, typer.Option(help="Of --live: the folder to which studies are saved.", file_okay=False)] = Path(),
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
    installed_only: InstalledOnly = False,
) -> None:
    """Write explore.html beside the report of a run, a page to be explored by hand without a network; or serve a live one.

    The page follows its parameter by the composite map of the study, in JavaScript, beside exact flights and return surfaces.
    The live page computes the exact map: rectangles that are dragged, points that are clicked, sliders of all parameters.
    """
    with reported_errors(), progress_line(quiet):
        folder = Path(what)
        is_run = (folder / "result.json").is_file()
        if live:
            _serve(str(folder / "study.yaml") if is_run else what, out, port, not no_browser, installed_only)
            return
        if not is_run:
            raise NsmapsError(f"{what} is not a folder that `nsmaps run` wrote; expected: one, or --live for a study")
        from nsmaps.explore.page.write import write_page
        from nsmaps.report.page import write_report
        from nsmaps.study.store.archive import read_result

        result = read_result(folder, installed_only=installed_only)
        path = write_page(result, folder)
        write_report(result, folder)
    typer.echo(str(path))


def _serve(study: str, out: Path, port: int, browser: bool, installed_only: bool) -> None:
    """The live page of a study, until Ctrl-C."""
    from nsmaps.explore.live.serve import serve
    from nsmaps.study.reading.reader import load_study

    serve(load_study(study, installed_only=installed_only), out, port, browser, typer.echo)
