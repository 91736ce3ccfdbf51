"""The figures of a run on its page: the key figure, the others, those of domains that bound nothing, and what is left to draw."""

import struct
from base64 import b64encode
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from nsmaps.figures.parts import invariant_or_first
from nsmaps.report.html import folded, tag
from nsmaps.study.conclusions.phrases import part_of
from nsmaps.study.conclusions.texts import as_computed
from nsmaps.study.pictures.catalogue import caption, drawable, figures_of, named_by
from nsmaps.study.result import StudyResult
from nsmaps.study.store.run_folder import files_of

WIDE = 1200  #: pixels from which a figure scrolls sideways on a narrow page instead of shrinking to it: four inches at 300 dpi
ASIDE = "sketch", "algorithm"  #: pictures of the device and of the method, which show no result
_PNG = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"  #: how a PNG begins and ends


@dataclass(frozen=True, slots=True)
class Picture:
    """A file of a figure, and the part of the result that it shows: empty for the first, or all."""

    path: Path
    name: str
    part: str

    @property
    def is_whole(self) -> bool:
        """Whether the file begins and ends as a PNG does."""
        content = self.path.read_bytes()
        return len(content) > 2 * len(_PNG[0]) + len(_PNG[1]) and content.startswith(_PNG[0]) and content.endswith(_PNG[1])


def figures_on_page(result: StudyResult, folder: Path) -> tuple[list[Element], list[Element]]:
    """The key figure, which is the first of the study that is there, and all others with the notes on figures."""
    pictures = _found(result, folder)
    whole = [picture for picture in pictures if picture.is_whole]
    open_, failed = [each for each in whole if _bounds(result, each)], [each for each in whole if not _bounds(result, each)]
    shown = {picture.name for picture in pictures}
    lines = [f"{spoken(name)} could not be drawn: {why}" for name, why in result.undrawn.items() if name not in shown]
    again = "{} is incomplete; nsmaps figures DIR --only {} draws it again"
    lines += [again.format(picture.path.name, picture.name) for picture in pictures if not picture.is_whole]
    if not whole and not lines:
        lines = ["None was drawn. nsmaps figures DIR draws those that the study names."]
    if more := drawable(result, shown):
        lines.append(f"Others that this run has the data for: {', '.join(map(spoken, more))}; nsmaps figures DIR --only NAME.")
    if parts := [name for name in dict.fromkeys(each.name for each in whole) if _has_more(result, name, whole)]:
        lines.append(f"Of {' and '.join(parts)} one domain is shown; nsmaps figures DIR --only NAME draws all.")
    title = f"Domains that bound nothing: {len(failed)} figures"
    folds = [folded(title, *(_figure(result, each) for each in failed))] if failed else []
    key = key_picture(result, folder)
    others = [_figure(result, each) for each in open_ if each != key]
    return [_figure(result, key)] if key else [], [*others, *folds, *_lines(lines)]


def key_picture(result: StudyResult, folder: Path) -> Picture | None:
    """The picture of the result: the first that the study names, apart from those of the device, the method and no domain."""
    shown = [each for each in _found(result, folder) if each.is_whole and _bounds(result, each)]
    return next((each for each in shown if each.name not in ASIDE), next(iter(shown), None))


def spoken(name: str) -> str:
    """A name of the package as words."""
    return name.replace("_", " ")


def _found(result: StudyResult, folder: Path) -> list[Picture]:
    """Those that the study names, in its order, then others that were drawn of these results."""
    named = named_by(result)
    later = {Path(path).stem for path in files_of(folder) if Path(path).parent.name == "figures"}
    files = sorted((folder / "figures").glob("*.png"), key=lambda path: path.stem)  # the first domain's before the others'
    return [
        Picture(path, name, path.stem.removeprefix(name).removeprefix("-"))
        for name in dict.fromkeys([*named, *figures_of(result.study.kinds())])
        for path in files
        if (path.stem == name or path.stem.startswith(f"{name}-")) and (name in named or path.stem in later)
    ]


def _bounds(result: StudyResult, picture: Picture) -> bool:
    """False for a sheet of a domain that is not forward invariant, unless it is the first."""
    if not (figures_of(result.study.kinds())[picture.name].by_domain and picture.part):
        return True
    domain = result.domains.get(part_of(result.domains, picture.part))
    return domain is not None and domain.forward_invariant


def _has_more(result: StudyResult, name: str, whole: list[Picture]) -> bool:
    """Whether a figure of domains is shown of some of those that it is drawn for."""
    drawn = sum(picture.name == name for picture in whole)
    return figures_of(result.study.kinds())[name].by_domain and drawn < len(invariant_or_first(result.domains))


def _figure(result: StudyResult, picture: Picture) -> Element:
    """A figure within the page, with its size, so that the page does not move while it is read."""
    content, row = picture.path.read_bytes(), figures_of(result.study.kinds())[picture.name]
    width, height = struct.unpack(">II", content[16:24])  # of the header chunk, with which every PNG begins
    source = f"data:image/png;base64,{b64encode(content).decode()}"
    text = as_computed(result, f"{picture.part}: {row.alt}" if picture.part else row.alt)
    box = tag("div", tag("img", src=source, alt=text, width=str(width), height=str(height)), class_="scroll", tabindex="0")
    title = f"{spoken(picture.name)}{f' ({picture.part})' if picture.part else ''}. "
    label = tag("figcaption", tag("b", title), caption(result, picture.name, picture.part))
    return tag("figure", box, label, class_=("wide" if width > WIDE else "narrow") + (" tall" if height > width else ""))


def _lines(lines: list[str]) -> list[Element]:
    return [tag("p", line, class_="soft") for line in lines]
