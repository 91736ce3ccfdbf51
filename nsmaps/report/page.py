"""The page of a run: verdicts first, then what was asked, figures, numbers, timings, versions, how to cite."""

import struct
from base64 import b64encode
from importlib.resources import files
from pathlib import Path
from xml.etree.ElementTree import Element, tostring

from nsmaps.figures.catalogue import CATALOGUE
from nsmaps.report.cite import citation, run_citation
from nsmaps.report.glossary import legend
from nsmaps.report.html import formatted, table, tables, tag
from nsmaps.storage import replace_file
from nsmaps.study.headline import headline
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import Verdict
from nsmaps.study.sections.motions import digits
from nsmaps.study.store.run_folder import files_of
from nsmaps.study.summary import numbers
from nsmaps.study.verdict import conclusion

FILE = "report.html"
WIDE = 1600  #: pixels from which a figure scrolls sideways on a narrow page instead of shrinking to it: more than one panel
_PNG = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"  #: how a PNG begins and ends
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"  #: a browser that obeys it sends no requests


def write_report(result: StudyResult, folder: Path) -> Path:
    """Write report.html into the folder of a run, from its result and the figures that were drawn there.

    Raises OSError when a file of the folder cannot be read, or the report cannot be written.
    """
    page = "<!DOCTYPE html>\n" + tostring(_page(result, folder), encoding="unicode", method="html")
    replace_file(folder / FILE, page.encode())
    return folder / FILE


def _page(result: StudyResult, folder: Path) -> Element:
    title = result.study.title or result.study.name
    sections = {
        "Verdicts": _verdicts(result),
        "What was asked": _asked(result, folder),
        "Figures": _figures(result, folder),
        "Numbers": _numbers(result),
        "Timings": _timings(result),
        "Versions": [table(["what", "version"], [[name, version] for name, version in result.versions.items()])],
        "How to cite": _cite(result, folder),
    }
    links = [tag("li", tag("a", name, href=f"#{_anchor(name)}")) for name in sections]
    body = [tag("section", tag("h2", name), *parts, id=_anchor(name)) for name, parts in sections.items()]
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", f"{title} (nsmaps)"),
        tag("style", files("nsmaps.report").joinpath("style.css").read_text(encoding="utf-8")),
    )
    above = tag("h1", title), _about(result), *_headline(result), _summary(result)
    header = tag("header", *above, tag("nav", tag("ul", *links), aria_label="Sections"))
    end = tag("footer", tag("p", f"Made by nsmaps {result.versions.get('nsmaps', '')} from the folder of the run alone."))
    return tag("html", head, tag("body", header, tag("main", *body), end), lang="en")


def _anchor(name: str) -> str:
    return name.lower().replace(" ", "-")


def _about(result: StudyResult) -> Element:
    given = ", ".join(f"{name} = {formatted(value)}" for name, value in result.system.parameters.items())
    seconds = sum(result.timings.values())
    return tag("p", f"Study {result.study.name} of the system {result.study.system} ({given}), {seconds:.1f} s", class_="soft")


def _headline(result: StudyResult) -> list[Element]:
    """The sentence on the results of the run, where there is one."""
    text = headline(result)
    return [tag("p", text, class_="headline")] if text else []


def _summary(result: StudyResult) -> Element:
    """One sentence on the verdicts, before anything else."""
    kind = "yes" if result.holds and result.finished else "no"
    return tag("p", conclusion(result), class_=f"summary {kind}", role="status")


def _verdicts(result: StudyResult) -> list[Element]:
    if not result.verdicts:
        return [tag("p", "This study makes no claim.")]
    head = ["claim", "of", "holds", "required", "because"]
    verdicts = table(head, [_verdict(verdict) for verdict in result.verdicts], class_="verdicts")
    for cell in verdicts.iter("td"):
        if not (cell.text or len(cell)):
            cell.set("class", "empty")
    note = "A claim speaks of one map: the exact map, or a map put in its place. Required ones decide the exit code of the run."
    terms = [part for term, text in legend(result) for part in (tag("dt", term), tag("dd", text))]
    return [tag("p", note, class_="soft"), verdicts, tag("h3", "Terms"), tag("dl", *terms)]


def _verdict(verdict: Verdict) -> list[Element | str]:
    kind = "yes" if verdict.holds else "no" if verdict.required else "unrequired"
    holds = tag("span", "✓ yes" if verdict.holds else "✗ no", class_=f"holds {kind}")
    return [verdict.name, verdict.of, holds, "yes" if verdict.required else "", verdict.text.partition(": ")[2]]


def _asked(result: StudyResult, folder: Path) -> list[Element]:
    note = "The study as it was run, with every number worked out. It is study.yaml in the run's folder, and can be run again."
    return [tag("p", note, class_="soft"), tag("pre", tag("code", (folder / "study.yaml").read_text(encoding="utf-8")))]


def _figures(result: StudyResult, folder: Path) -> list[Element]:
    """Those that the study names, then others that were drawn of these results; of what could not be drawn, why."""
    named = dict.fromkeys([*result.study.figures, *(["speed_error"] if result.speed else [])])
    later = {Path(path).stem for path in files_of(folder) if Path(path).parent.name == "figures"}
    found = sorted((folder / "figures").glob("*.png"), key=lambda path: path.stem)  # the first domain's before the others'
    pictures = [
        (path, name)
        for name in dict.fromkeys([*named, *CATALOGUE])
        for path in found
        if (path.stem == name or path.stem.startswith(f"{name}-")) and (name in named or path.stem in later)
    ]
    shown = {name for _, name in pictures}
    lacking = [f"{_spoken(name)} could not be drawn: {why}" for name, why in result.undrawn.items() if name not in shown]
    again = "{} is incomplete; nsmaps figures DIR --only {} draws it again"
    lacking += [again.format(path.name, name) for path, name in pictures if not _is_whole(path)]
    if not pictures and not lacking:
        return [tag("p", "None was drawn. nsmaps figures DIR draws those that the study names, and nsmaps report DIR adds them.")]
    whole = [(path, name) for path, name in pictures if _is_whole(path)]
    return [*(_figure(path, name, path.stem.removeprefix(name).strip("-")) for path, name in whole), *_lines(lacking)]


def _is_whole(path: Path) -> bool:
    """Whether a file begins and ends as a PNG does."""
    content = path.read_bytes()
    return len(content) > 2 * len(_PNG[0]) + len(_PNG[1]) and content.startswith(_PNG[0]) and content.endswith(_PNG[1])


def _lines(lines: list[str]) -> list[Element]:
    return [tag("ul", *(tag("li", line) for line in lines))] if lines else []


def _spoken(name: str) -> str:
    return name.replace("_", " ")


def _figure(path: Path, name: str, subject: str) -> Element:
    """A figure within the page, with its size, so that the page does not move while it is read."""
    content = path.read_bytes()
    width, height = struct.unpack(">II", content[16:24])  # of the header chunk, with which every PNG begins
    row = CATALOGUE[name]
    source = f"data:image/png;base64,{b64encode(content).decode()}"
    text = f"{subject}: {row.alt}" if subject else row.alt
    image = tag("img", src=source, alt=text, width=str(width), height=str(height))
    box = tag("div", image, class_="scroll", tabindex="0")
    label = tag("figcaption", tag("b", f"{_spoken(name)}{f' ({subject})' if subject else ''}. "), row.caption)
    return tag("figure", box, label, class_=("wide" if width > WIDE else "narrow") + (" tall" if height > width else ""))


def _numbers(result: StudyResult) -> list[Element]:
    """The numbers of each section as tables; those of a diagram have the parameter to the digits that distinguish its values."""
    data = numbers(result)
    for map_name, diagram in result.bifurcation.items():
        for rows in data["bifurcation"][map_name].values():
            for row in rows if isinstance(rows, list) else ():
                row["from"], row["to"] = digits([row["from"], row["to"]], diagram)
    note = "Those of result.json, by section. Angles are in radians, times of the section Speed in nanoseconds per state."
    return [
        tag("p", note, class_="soft"),
        *(part for name, section in data.items() for part in tables(section, 3, name.capitalize())),
    ]


def _timings(result: StudyResult) -> list[Element]:
    total = sum(result.timings.values())
    rows = [[_spoken(name), f"{spent:.2f}", f"{100 * spent / total:.0f} %"] for name, spent in result.timings.items()]
    note = (
        "Seconds of wall-clock time by step; the first, of the system, compiles the map or fetches it from the cache. "
        "Figures are those that the run drew; this page is made after them."
    )
    return [tag("p", note, class_="soft"), table(["step", "seconds", "share"], [*rows, ["all", f"{total:.2f}", ""]])]


def _cite(result: StudyResult, folder: Path) -> list[Element]:
    run = run_citation(result.study.name, result.study.title, result.versions, folder)
    text = f"{citation(result.versions.get('nsmaps', ''))}\n{run}"
    return [tag("p", "The software, the paper whose method it implements, and this run."), tag("pre", tag("code", text))]
