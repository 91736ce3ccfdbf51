"""The gallery made anew: `python docs/gallery/make.py` runs the studies, draws their figures and writes index.md.

With names of files of the list, only these are drawn. Runs that are in `--runs DIR` already are not run again; without it
they go to a folder that is removed in the end.
"""

import os
import shutil
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from PIL import Image
from ruamel.yaml import YAML

HERE = Path(__file__).parent
FORMATS = ("png", "svg", "pdf")
DPI = 110
HEAD = """# Gallery

Every figure of the paper, drawn by `nsmaps figures` from the runs of studies that are shipped: nothing here was drawn by
hand. Labels in code type are those of the paper's source. The colours are distinguishable with colour blindness. Where ours
differs from the paper, the sentence says so; [the paper](../paper.md) has the numbers side by side. The pictures in order,
as a story: [the method in pictures](../method.md).

`python docs/gallery/make.py` makes all of it anew, from the list in `figures.yaml`.
"""


def listed() -> dict[str, list[dict[str, Any]]]:
    """The figures and the animations of the list."""
    return YAML(typ="safe").load((HERE / "figures.yaml").read_text(encoding="utf-8"))


def nsmaps(*arguments: object) -> None:
    """Run a command; a study whose required verdicts fail is shown all the same."""
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "0"}  # files of the same picture are the same
    code = subprocess.run([sys.executable, "-m", "nsmaps", *map(str, arguments)], env=environment, check=False).returncode
    if code not in (0, 1):
        raise SystemExit(f"nsmaps {' '.join(map(str, arguments))} ended with {code}")


def small(path: Path) -> None:
    """Keep a picture in 256 colours, also those that are rare in it, which halves it."""
    with Image.open(path) as picture:
        fewer = picture.convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=4, dither=Image.Dither.NONE)
    fewer.save(path, optimize=True)


def make(runs: Path, drawn: Path, files: list[str]) -> None:
    """Run the studies of these files that are not in `runs`, draw their figures, and copy those of the list beside this file."""
    entries = {part: [entry for entry in every if entry["file"] in files] for part, every in listed().items()}
    for study in dict.fromkeys(entry["study"] for part in entries.values() for entry in part):
        if not (runs / study / "result.json").exists():
            nsmaps("run", study, "--out", runs / study, "--quiet", "--no-figures", "--no-report")
    kinds = [word for kind in FORMATS for word in ("--format", kind)]
    for study, figure in dict.fromkeys((entry["study"], entry["figure"]) for entry in entries["figures"]):
        nsmaps("figures", runs / study, "--only", figure, *kinds, "--dpi", DPI, "--out", drawn / study)
    for entry in entries["figures"]:
        for kind in FORMATS:
            sheet = drawn / entry["study"] / f"{entry.get('sheet', entry['figure'])}.{kind}"
            shutil.copyfile(sheet, HERE / f"{entry['file']}.{kind}")
        small(HERE / f"{entry['file']}.png")
    for entry in entries["animations"]:
        options = [word for key, value in entry["options"].items() for word in (f"--{key}", value)]
        nsmaps("animate", runs / entry["study"], entry["name"], *options, "--out", drawn)
        shutil.move(drawn / f"{entry['name']}.gif", HERE / f"{entry['file']}.gif")


def page() -> Iterator[str]:
    """The lines of the page."""
    from nsmaps.figures.catalogue import CATALOGUE

    entries = listed()
    yield HEAD
    for label, group in groupby(entries["figures"], key=lambda entry: entry["label"]):
        yield f"## `{label}`\n"
        for entry in group:
            links = ", ".join(f"[{kind.upper()}]({entry['file']}.{kind})" for kind in FORMATS)
            yield f"{entry['says']}\n"
            yield f"![{CATALOGUE[entry['figure']].alt}]({entry['file']}.png)\n"
            yield f"Figure `{entry['figure']}` of the study `{entry['study']}`: {links}.\n"
    yield "## Animations\n"
    for entry in entries["animations"]:
        options = " ".join(f"--{key} {value}" for key, value in entry["options"].items())
        yield f"{entry['says']}\n"
        yield f"![{entry['says']}]({entry['file']}.gif)\n"
        yield f"`nsmaps animate DIR {entry['name']} {options}`, where DIR is a run of `{entry['study']}`.\n"


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__)
    every = [entry["file"] for part in listed().values() for entry in part]
    parser.add_argument("--runs", type=Path, help="where runs are kept, and taken from")
    parser.add_argument("files", nargs="*", default=every, metavar="FILE", help="a file of the list, without its suffix")
    asked = parser.parse_args()
    with TemporaryDirectory() as scratch:
        make(asked.runs or Path(scratch, "runs"), Path(scratch, "drawn"), asked.files)
    (HERE / "index.md").write_text("\n".join(page()).rstrip() + "\n", encoding="utf-8")
