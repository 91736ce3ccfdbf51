"""The command `nsmaps explore`: an offline page of a run, or a live page of a study."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nsmaps.cli.options import InstalledOnly, Settings
from nsmaps.cli.terminal import examples, progress_line, reported_errors
from nsmaps.errors import NsmapsError, near_match

if TYPE_CHECKING:
    from nsmaps.study.study import Study

EXAMPLES = examples("nsmaps run vi_pair/explore", "nsmaps explore runs/vi_pair/explore", "nsmaps explore vi_pair/fp --live")


def explore(
    what: Annotated[
        str, typer.Argument(metavar="DIR|STUDY", help="A folder that `nsmaps run` wrote; with --live a study or a system too.")
    ],
    live: Annotated[bool, typer.Option("--live", help="Serve a page that computes while it is used, until Ctrl-C.")] = False,
    port: Annotated[int, typer.Option(help="With --live: the port; 0 is any free one.")] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="With --live: do not open a browser, print the address only.")
    ] = False,
    out: Annotated[Path, typer.Option(help="With --live: the folder for saved studies.", file_okay=False)] = Path(),
    set_: Settings = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
    installed_only: InstalledOnly = False,
) -> None:
    """Write explore.html beside the report of a run, a page to be explored without a network, or serve a live page.

    The page shows diagrams, branches, planes and basins of the run. Of a composite map it follows the parameter, in JavaScript,
    beside exact flights and return surfaces.
    The live page computes the exact map: rectangles that are dragged, points that are clicked, sliders of all parameters.
    """
    with reported_errors(), progress_line(quiet):
        folder = Path(what)
        is_run = (folder / "result.json").is_file()
        if live:
            study = _study(str(folder / "study.yaml") if is_run else what, set_ or [], installed_only)
            from nsmaps.explore.live.serve import serve

            serve(study, out, port, not no_browser, typer.echo)
            return
        if set_:
            raise NsmapsError(f"--set {set_[0]} is of --live; expected: the run of a study with it, or --live")
        if not is_run:
            raise NsmapsError(f"{what} is not a folder that `nsmaps run` wrote; expected: one, or --live for a study or a system")
        from nsmaps.explore.page.write import write_page
        from nsmaps.report.page import write_report
        from nsmaps.study.store.archive import read_result

        result = read_result(folder, installed_only=installed_only)
        path = write_page(result, folder)
        write_report(result, folder)
    typer.echo(str(path))


def _study(name: str, settings: list[str], installed_only: bool) -> "Study":
    """The study of this name, or one of a system alone; with parameters set."""
    from nsmaps.plugins import is_file, study_names, system_names
    from nsmaps.study.reading.overrides import assignments
    from nsmaps.study.reading.reader import check_installed, load_study, made_ready
    from nsmaps.study.study import Study

    systems = system_names()
    if not (is_file(name) or name in systems):
        if "/" not in name and not Path(name).exists():
            near = near_match(name, [*systems, *study_names()])
            expected = "the path of a YAML file, one of those that `nsmaps systems` lists, or path/to/mine.py:Class"
            raise NsmapsError(f"no study or system {name!r}{near}; expected: {expected}")
        return load_study(name, assignments(settings), installed_only=installed_only)
    study = Study.model_validate({"name": name.rpartition(":")[2], "system": name})
    if installed_only:
        check_installed(study)
    return made_ready(study, assignments(settings))
