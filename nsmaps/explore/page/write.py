"""The page of a run in one file, which a browser shows without a network: `explore.html` beside the report."""

import gzip
import json
from base64 import b64encode
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from nsmaps.errors import NsmapsError
from nsmaps.explore.page.data import data_of, has_map
from nsmaps.explore.page.plots import plots_of
from nsmaps.explore.page.sweep import exact_script, lettered, sweep_of
from nsmaps.files.storage import replace_file
from nsmaps.report.page import EXPLORE
from nsmaps.study.conclusions.headline import headline

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_SCRIPTS = ("motion.js", "surfaces.js", "explore.js")  #: of a page with a map, in the order in which they are read
_CLICK = "Click, or press the arrow keys, to set the parameter."


def write_page(result: "StudyResult", folder: Path) -> Path:
    """Write explore.html into the folder of a run, from its result, and return its path.

    A run with a composite map of two coordinates has a page that moves it; every other run one of its own pictures, with values
    under the pointer.

    The map of the page is the composite map in JavaScript, at every value of the parameter if the study has `parametric_map`;
    without one it is that of a system given by formulas. Diagrams are computed anew from it and from the exact map, where that
    can be exported and follows the parameter. The flights and surfaces are those of the exact map, computed now.

    Raises:
        NsmapsError: plotly is not installed, or the result has nothing that is drawn.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise NsmapsError("the page draws by plotly.js, which is not installed; pip install 'nsmaps[explore]'") from error
    exact, scripts = exact_script(result), _SCRIPTS if has_map(result) else ("plots.js",)
    if has_map(result):
        data, template = data_of(result), "page.html"
        parts = {"map": exact + data.pop("script"), "click": _CLICK if (data["sweep"] or {}).get("moves") else ""}
    else:
        sweep = sweep_of(result) if exact else None
        data, template = {"plots": plots_of(result, sweep is None), "sweep": sweep}, "plots.html"
        if not (data["plots"] or sweep):
            raise NsmapsError(
                f"the run of {result.study.name!r} has nothing to explore; expected: a study with bifurcation_diagram, branches, "
                "basins, parameter_plane, lyapunov or orbits, or `nsmaps explore STUDY --live`, which shows "
                "the exact map of any study"
            )
        given = ", ".join(f"{name} = {value:.6g}" for name, value in result.system.parameters.items())
        about = escape(lettered(f"{result.study.system}, {given}. {headline(result)}", result.system))
        parts = {"about": about, "map": exact, "click": ""}
    room = files("nsmaps.explore.page")
    parts |= {
        "map": packed(parts["map"]),
        "title": escape(result.study.title or result.study.name),
        "style": room.joinpath("page.css").read_text(encoding="utf-8"),
        "plotly": packed(get_plotlyjs()),
        "data": packed(f"const DATA = {json.dumps(data, allow_nan=False, separators=(',', ':'))}"),
        "scripts": packed(
            "\n".join(room.joinpath(name).read_text(encoding="utf-8") for name in ("frame.js", "diagram.js", *scripts))
        ),
        "unpack": room.joinpath("unpack.js").read_text(encoding="utf-8"),
    }
    head, section, body = (room.joinpath(name).read_text(encoding="utf-8") for name in ("head.html", "diagram.html", template))
    parts["diagram"] = Template(section).substitute(parts) if data["sweep"] else ""
    text = Template(head + body).substitute(parts)
    replace_file(folder / EXPLORE, text.encode())
    return folder / EXPLORE


def packed(script: str) -> str:
    """A script, compressed, as letters: `unpack.js` of the page reads and runs it."""
    return b64encode(gzip.compress(script.encode(), mtime=0)).decode("ascii")
