"""The page of a run in one file, which a browser shows without a network: `explore.html` beside the report."""

import json
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from nsmaps.errors import NsmapsError
from nsmaps.explore.page.data import data_of, has_map
from nsmaps.explore.page.plots import plots_of
from nsmaps.files.storage import replace_file
from nsmaps.report.page import EXPLORE
from nsmaps.study.conclusions.headline import headline

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_SCRIPTS = ("frame.js", "diagram.js", "motion.js", "surfaces.js", "explore.js")  #: in the order in which they are read


def write_page(result: "StudyResult", folder: Path) -> Path:
    """Write explore.html into the folder of a run, from its result, and return its path.

    A run with a composite map of two coordinates has a page that moves it; every other run one of its own pictures, with values
    under the pointer.

    The map of the page is the composite map in JavaScript, at every value of the parameter if the study has `parametric`; without
    one it is that of a system given by formulas. The flights and surfaces are those of the exact map, computed now.

    Raises:
        NsmapsError: plotly is not installed, or the result has nothing that is drawn.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise NsmapsError("the page draws by plotly.js, which is not installed; pip install 'nsmaps[explore]'") from error
    scripts: tuple[str, ...] = _SCRIPTS
    if has_map(result):
        data: Any = data_of(result)
        template = "page.html"
        parts = {"map": data.pop("script").replace("</", "<\\/").replace("<!--", "<\\!--")}
    else:
        data, template, scripts = plots_of(result), "plots.html", ("plots.js",)
        if not data:
            raise NsmapsError(
                f"the run of {result.study.name!r} has nothing to explore; expected: a study with bifurcation_diagram, branches, "
                "basins, parameter_plane, lyapunov or orbits, or `nsmaps explore STUDY --live`, which shows "
                "the exact map of any study"
            )
        given = ", ".join(f"{name} = {value:.6g}" for name, value in result.system.parameters.items())
        parts = {"about": escape(f"{result.study.system}, {given}. {headline(result)}")}
    room = files("nsmaps.explore.page")
    parts |= {
        "title": escape(result.study.title or result.study.name),
        "style": room.joinpath("page.css").read_text(encoding="utf-8"),
        "plotly": get_plotlyjs(),
        "data": json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
        "scripts": "\n".join(room.joinpath(name).read_text(encoding="utf-8") for name in scripts),
    }
    whole = "".join(room.joinpath(name).read_text(encoding="utf-8") for name in ("head.html", template))
    text = Template(whole).substitute(parts)
    replace_file(folder / EXPLORE, text.encode())
    return folder / EXPLORE
