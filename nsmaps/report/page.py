"""The page of a run: headline, key figure, main numbers, other figures, what fails; folded below: all else."""

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from xml.etree.ElementTree import Element, tostring

from nsmaps.files.storage import replace_file
from nsmaps.report.cite import citation, run_citation
from nsmaps.report.glossary import legend
from nsmaps.report.html import folded, table, tables, tag, typeset
from nsmaps.report.pictures import figures_on_page, spoken
from nsmaps.study.conclusions.headline import headline, key_numbers
from nsmaps.study.conclusions.phrases import parameters
from nsmaps.study.conclusions.summary import numbers
from nsmaps.study.conclusions.verdict import conclusion
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import Verdict
from nsmaps.study.sections.parameters.motions import digits

FILE = "report.html"
EXPLORE = "explore.html"  #: a page beside the report, named in it where it is there
KEY_NUMBERS = 8  #: at most
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
    key, figures = figures_on_page(result, folder)
    versions = table(["what", "version"], [[name, version] for name, version in result.versions.items()])
    folds = {
        f"Verdicts ({len(result.verdicts)})": _verdicts(result),
        "Numbers": _numbers(result),
        "What was asked": _asked(folder),
        "Timings": _timings(result),
        "Versions": [versions],
        "How to cite": _cite(result, folder),
    }
    sections = {"More figures": figures, "What fails": _failures(result)}
    body = [tag("section", tag("h2", name), *parts, id=_anchor(name)) for name, parts in sections.items() if parts]
    body += [folded(name, *parts, id=_anchor(name)) for name, parts in folds.items()]
    links = [tag("li", tag("a", name, href=f"#{_anchor(name)}")) for name in (*sections, *folds) if sections.get(name, True)]
    if (folder / EXPLORE).is_file():
        links.insert(0, tag("li", tag("a", "Explore", href=EXPLORE)))
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", f"{title} (nsmaps)"),
        tag("style", files("nsmaps.report").joinpath("style.css").read_text(encoding="utf-8")),
    )
    header = tag("header", tag("h1", title), _about(result), *_headline(result), *_summary(result))
    nav = tag("nav", tag("ul", *links), aria_label="Sections")
    end = tag("footer", tag("p", f"Made by nsmaps {result.versions.get('nsmaps', '')} from the folder of the run alone."))
    page = tag("body", header, nav, tag("main", *key, *_key_numbers(result), *body), end)
    typeset(page, [*result.system.coordinates, *result.system.parameters])
    return tag("html", head, page, lang="en")


def _anchor(name: str) -> str:
    return name.partition(" (")[0].lower().replace(" ", "-")


def _about(result: StudyResult) -> Element:
    given = parameters(result)
    seconds = sum(result.timings.values())
    return tag("p", f"Study {result.study.name} of the system {result.study.system} ({given}), {seconds:.1f} s", class_="soft")


def _headline(result: StudyResult) -> list[Element]:
    """The sentences on the results of the run."""
    text = headline(result)
    return [tag("p", text, class_="headline")] if text else []


def _key_numbers(result: StudyResult) -> list[Element]:
    """The main numbers with their meanings."""
    rows = [part for value, meaning in key_numbers(result, KEY_NUMBERS) for part in (tag("dt", value), tag("dd", meaning))]
    return [tag("dl", *rows, class_="key")] if rows else []


def _summary(result: StudyResult) -> list[Element]:
    """What the verdicts come to: green and red of those required, amber where others fail, else without a colour."""
    text = conclusion(result)
    required = any(verdict.required for verdict in result.verdicts)
    kind = "no" if not (result.holds and result.finished) else "warn" if _failed(result) else "yes" if required else ""
    return [tag("p", text, class_=f"status {kind}".rstrip(), role="status")] if text else []


def _failed(result: StudyResult) -> list[Verdict]:
    """The verdicts that fail and are not expected to."""
    return [verdict for verdict in result.verdicts if not verdict.holds and not verdict.shows]


def _failures(result: StudyResult) -> list[Element]:
    failed = _failed(result)
    return [_verdict_table(failed)] if failed else []


def _verdict_table(verdicts: Sequence[Verdict]) -> Element:
    rows = table(["claim", "of", "holds", "required", "because"], [_verdict(verdict) for verdict in verdicts], class_="verdicts")
    for cell in rows.iter("td"):
        if not (cell.text or len(cell)):
            cell.set("class", "empty")
    return rows


def _verdicts(result: StudyResult) -> list[Element]:
    if not result.verdicts:
        return [tag("p", "This study makes no claim.")]
    note = f"A claim is of one map: the {result.system.map_name}, or one put in its place. Required ones decide the exit code."
    terms = [part for term, text in legend(result) for part in (tag("dt", term), tag("dd", text))]
    return [tag("p", note, class_="soft"), _verdict_table(result.verdicts), folded("Terms", tag("dl", *terms))]


def _verdict(verdict: Verdict) -> list[Element | str]:
    kind = "yes" if verdict.holds else "no" if verdict.required else "unrequired"
    holds = tag("span", "✓ yes" if verdict.holds else "✗ no", class_=f"holds {kind}")
    return [verdict.name, verdict.of, holds, "yes" if verdict.required else "", verdict.text.partition(": ")[2]]


def _asked(folder: Path) -> list[Element]:
    note = "The study as it was run, with every number worked out. It is study.yaml in the run's folder, and can be run again."
    study = tag("pre", tag("code", (folder / "study.yaml").read_text(encoding="utf-8")))
    return [tag("p", note, class_="soft"), study]


def _numbers(result: StudyResult) -> list[Element]:
    """The numbers of each section as tables; those of a diagram have the parameter to the digits that distinguish its values."""
    data = numbers(result)
    for map_name, diagram in result.bifurcation_diagram.items():
        for rows in data["bifurcation_diagram"][map_name].values():
            for row in rows if isinstance(rows, list) else ():
                if "from" in row:
                    row["from"], row["to"] = digits([row["from"], row["to"]], diagram)
    note = "Those of result.json, by section. Angles are in radians, times of the section Speed in nanoseconds per state."
    return [
        tag("p", note, class_="soft"),
        *(folded(name.capitalize().replace("_", " "), *tables(section, 3)) for name, section in data.items()),
    ]


def _timings(result: StudyResult) -> list[Element]:
    total = sum(result.timings.values())
    rows = [[spoken(name), f"{spent:.2f}", f"{100 * spent / total:.0f} %"] for name, spent in result.timings.items()]
    note = (
        "Seconds of wall-clock time by step; the first, of the system, compiles the map or fetches it from the cache. "
        "Figures are those that the run drew; this page is made after them."
    )
    return [
        tag("p", note, class_="soft"),
        table(["step", "seconds", "share"], [*rows, ["all", f"{total:.2f}", ""]]),
    ]


def _cite(result: StudyResult, folder: Path) -> list[Element]:
    run = run_citation(result.study.name, result.study.title, result.versions, folder)
    text = f"{citation(result.versions.get('nsmaps', ''))}\n{run}"
    return [
        tag("p", "The software, the paper whose method it implements, and this run."),
        tag("pre", tag("code", text), class_="wrapped"),
    ]
