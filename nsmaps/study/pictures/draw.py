"""The files of the figures of a study's result."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from nsmaps.errors import NsmapsError, check_known
from nsmaps.study.pictures.catalogue import figures_of

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult


def draw(
    result: "StudyResult",
    names: Iterable[str],
    folder: str | Path,
    formats: Sequence[str] = ("png",),
    dpi: float = 300,
    width: float = 5.1,
    first: bool = False,
    letters: Mapping[str, str] | None = None,
    style: str = "",
    grey: bool = False,
) -> list[Path]:
    """The files of the named figures, written into `folder`, which is made if it is not there; `width` in inches.

    All type is of 8 points at every width; 5.1 inches are a page of a journal, 3.4 a column of two.

    Of a figure with a sheet for every domain all are drawn, or that of the `first` domain alone. `letters` has those of the
    panels of some files, by the file's name without its suffix, a blank for a panel without: a, b, c, ... if omitted.

    In the `style` of a `journal` type has serifs, and a text file beside each figure has its caption, with the titles of panels
    and the units that are then missing in the picture.

    With `grey` each figure is also drawn without colour, as `grey-NAME.png`, and a text of this name has the entries of its
    legend whose lightness differs by less than 10 of 100, if there are any.

    Nothing is written if one of the figures cannot be drawn for want of data.

    Raises:
        NsmapsError: an unknown figure; a figure whose data the result lacks; a format matplotlib cannot write; more letters
            than panels, or fewer.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from nsmaps.figures.style import drawing
    from nsmaps.results import units_of

    known = FigureCanvasAgg.get_supported_filetypes()
    figures = figures_of(result.study.kinds())
    for kind, asked, accepted in (("figure", names := list(names), figures), ("format", list(formats), known)):
        for word in asked:
            check_known(f"there is no {kind}", word, accepted)
    sheets = [(sheet, figures[name].caption) for name in dict.fromkeys(names) for sheet in figures[name].sheets(result, first)]
    for sheet, _ in sheets:
        given = (letters or {}).get(sheet.name, "")
        if given and len(given) != len(sheet.panels):
            raise NsmapsError(f"{sheet.name!r} has {len(sheet.panels)} panels, its letters are {given!r}; expected: one a panel")
    Path(folder).mkdir(parents=True, exist_ok=True)
    paths: list[Path] = []
    for sheet, caption in sheets:
        with drawing(units_of(result.system), style) as notes:
            paths += replace(sheet, letters=(letters or {}).get(sheet.name, "")).save(Path(folder), formats, dpi, width, grey)
            if style:
                paths.append(Path(folder, f"{sheet.name}.txt"))
                paths[-1].write_text("\n".join(f"{text.rstrip('.')}." for text in dict.fromkeys([caption, *notes])) + "\n")
    return paths
