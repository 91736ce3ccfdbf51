"""The page of a run in one file, which a browser shows without a network: `explore.html` beside the report."""

import json
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from nsmaps.errors import NsmapsError
from nsmaps.explore.page.data import data_of
from nsmaps.files.storage import replace_file
from nsmaps.report.page import EXPLORE

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_SCRIPTS = ("frame.js", "diagram.js", "motion.js", "surfaces.js", "explore.js")  #: in the order in which they are read


def write_page(result: "StudyResult", folder: Path) -> Path:
    """Write explore.html into the folder of a run, from its result, and return its path.

    The map of the page is the composite map in JavaScript, at every value of the parameter if the study has `parametric`; without
    one it is that of a system given by formulas. The flights and surfaces are those of the exact map, computed now.

    Raises:
        NsmapsError: plotly is not installed, or the result has no composite map of two coordinates.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise NsmapsError("the page draws by plotly.js, which is not installed; pip install 'nsmaps[explore]'") from error
    data = data_of(result)
    room = files("nsmaps.explore.page")
    parts = {
        "title": escape(data["title"]),
        "style": room.joinpath("page.css").read_text(encoding="utf-8"),
        "plotly": get_plotlyjs(),
        "map": data.pop("script").replace("</", "<\\/").replace("<!--", "<\\!--"),
        "data": json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
        "scripts": "\n".join(room.joinpath(name).read_text(encoding="utf-8") for name in _SCRIPTS),
    }
    text = Template(room.joinpath("page.html").read_text(encoding="utf-8")).substitute(parts)
    replace_file(folder / EXPLORE, text.encode())
    return folder / EXPLORE
