"""All pictures made anew: `python docs/gallery/make.py` runs the studies of the list `figures.yaml`, draws, and writes index.md.

Only pictures that are missing or stale are made, all of them with `--all`; with names of files of the list these. Runs in
`--runs DIR` that the same code made from the same studies are not run again, with `--accept` those of any code; without a
folder they go to one that is removed in the end.
Studies, drawings and animations are independent programs, as many at a time as there are cores.
"""

import os
import shutil
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory

import blocks
from pictures import (
    COMPUTED,
    DPI,
    FORMATS,
    HERE,
    KEY,
    ROOT,
    Picture,
    asked,
    computing,
    digest,
    listed,
    loaded,
    pictures,
    study_of,
)
from PIL import Image, PngImagePlugin

CODE = "code.txt"  #: in the folder of a run, the hash of the code that computed it
HEAD = """# Gallery

Every figure of the paper, drawn by `nsmaps figures` from runs of shipped studies. Headings are labels of the paper's source.
[The paper](../explanation/paper.md) compares the numbers, and [the method in pictures](../explanation/method.md) has the
pictures in order. `python docs/gallery/make.py` redraws them from `figures.yaml`.
"""


def nsmaps(*arguments: object) -> None:
    """Run a command; a study whose required verdicts fail is shown all the same."""
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "0"}  # files of the same picture are the same
    code = subprocess.run([sys.executable, "-m", "nsmaps", *map(str, arguments)], env=environment, check=False).returncode
    if code not in (0, 1):
        raise SystemExit(f"nsmaps {' '.join(map(str, arguments))} ended with {code}")


def place(runs: Path, study: str) -> Path:
    """The folder of a run."""
    return runs / study


def is_current(folder: Path, study: str, accept: bool = False) -> bool:
    """Whether a run of a study is there, of what the study asks for now, and by the code that there is now, or by any."""
    from nsmaps import load_study

    code = folder / CODE
    by = code.read_text(encoding="utf-8") if code.is_file() else ""
    if not (folder / "result.json").is_file() or not (accept or by == computing(study)):
        return False
    return study == COMPUTED or asked(load_study(folder / "study.yaml")) == asked(loaded(study))


def run(runs: Path, study: str, accept: bool) -> None:
    """Run a study, unless its run is there."""
    folder = place(runs, study)
    if is_current(folder, study, accept):
        return
    shutil.rmtree(folder, ignore_errors=True)
    if study == COMPUTED:
        subprocess.run([sys.executable, "-c", f"from computed import *; compute(Path({str(folder)!r}))"], cwd=HERE, check=True)
    else:
        nsmaps("run", study_of(study), "--out", folder, "--quiet", "--no-figures", "--no-report")
    (folder / CODE).write_text(computing(study), encoding="utf-8")


def draw(runs: Path, scratch: Path, study: str, wanted: Sequence[Picture]) -> None:
    """Draw the figures of one run that are no animations, by one program."""
    names = [word for figure in dict.fromkeys(each.figure for each in wanted) for word in ("--only", figure)]
    kinds = [word for kind in dict.fromkeys(kind for each in wanted for kind in each.formats) for word in ("--format", kind)]
    letters = [word for each in wanted if each.letters for word in ("--letters", f"{each.sheet}={each.letters}")]
    out = scratch / study
    nsmaps("figures", place(runs, study), *names, *kinds, *letters, "--dpi", DPI, "--out", out)
    for each in wanted:
        for kind in each.formats:
            shutil.copyfile(out / f"{each.sheet}.{kind}", each.path.with_suffix(f".{kind}"))
        keep(each)


def animate(runs: Path, scratch: Path, each: Picture) -> None:
    """Write an animation."""
    out = scratch / each.file.stem
    options = [word for key, value in each.options for word in (f"--{key}", value)]
    nsmaps("animate", place(runs, each.study), each.figure, *options, "--quiet", "--out", out)
    keep(each, out / f"{each.figure}.gif")


def keep(each: Picture, made: Path | None = None) -> None:
    """Write the digest of what it was drawn from into a picture, and a PNG in 256 colours, also those that are rare in it."""
    with Image.open(made or each.path) as picture:
        if each.is_animated:
            picture.save(each.path, save_all=True, comment=digest(each), loop=0)
            return
        fewer = picture.convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=4, dither=Image.Dither.NONE)
    said = PngImagePlugin.PngInfo()
    said.add_text(KEY, digest(each))
    fewer.save(each.path, optimize=True, pnginfo=said)


def tabled(scratch: Path, each: Picture) -> None:
    """Draw a picture of measured times."""
    from tables import draw

    shutil.copyfile(draw(each.table, scratch, DPI), each.path)
    keep(each)


def make(runs: Path, scratch: Path, wanted: Sequence[Picture], accept: bool = False) -> None:
    """Make pictures: runs first, then what is drawn of them."""
    of: dict[str, list[Picture]] = {}
    for each in wanted:
        of.setdefault(each.study, []).append(each)
    tables = of.pop("", [])
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda study: run(runs, study, accept), of))
        still = [(study, [each for each in every if not each.is_animated]) for study, every in of.items()]
        waits = [pool.submit(animate, runs, scratch, each) for each in wanted if each.is_animated]
        waits += [pool.submit(draw, runs, scratch, study, every) for study, every in still if every]
        for wait in waits:
            wait.result()
    scratch.mkdir(exist_ok=True)
    for name in dict.fromkeys(each.page for each in tables if each.page):
        blocks.run(ROOT / name, scratch / Path(name).stem, DPI)
    for each in tables:
        if each.page:
            keep(each, scratch / Path(each.page).stem / each.file.name)
        else:
            tabled(scratch, each)


def page() -> Iterator[str]:
    """The lines of the page."""
    from nsmaps.study.study import CATALOGUE

    entries = listed()
    shown: set[str] = set()  # figures of which the page has one
    yield HEAD
    for label, group in groupby(entries["figures"], key=lambda entry: entry["label"]):
        yield f"## `{label}`\n"
        for entry in group:
            links = ", ".join(f"[{kind.upper()}]({entry['file']}.{kind})" for kind in FORMATS[1:])
            yield f"{entry['says']}\n"
            alt = f"The same of {entry['study']}." if entry["figure"] in shown else CATALOGUE[entry["figure"]].alt
            shown.add(entry["figure"])
            yield f"![{alt}]({entry['file']}.png)\n"
            yield f"`{entry['figure']}` of `{entry['study']}`: {links}.\n"
    yield "## Animations\n"
    for entry in entries["animations"]:
        options = " ".join(f"--{key} {value}" for key, value in entry["options"].items())
        yield f"{entry['says']}\n"
        yield f"![Animation of {entry['name']}]({entry['file']}.gif)\n"
        yield f"`nsmaps animate DIR {entry['name']} {options}`, where DIR is a run of `{entry['study']}`.\n"


if __name__ == "__main__":
    every = pictures()
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=Path, help="where runs are kept, and taken from")
    parser.add_argument("--all", action="store_true", help="also those that are not stale")
    parser.add_argument("--accept", action="store_true", help="take the runs that are there, by whatever code they were made")
    parser.add_argument("--stale", action="store_true", help="name those that are stale, and make none")
    parser.add_argument("files", nargs="*", metavar="FILE", help="a file of the list, without its suffix")
    given = parser.parse_args()
    names = [each.file.stem for each in every]
    if unknown := set(given.files) - set(names):
        parser.error(f"{', '.join(sorted(unknown))}: not in the list; expected: {', '.join(names)}")
    wanted = [each for each in every if (each.file.stem in given.files if given.files else given.all or each.is_stale)]
    if given.stale:
        print("\n".join(each.file.as_posix() for each in wanted))
        raise SystemExit(bool(wanted))
    with TemporaryDirectory() as scratch:
        make((given.runs or Path(scratch, "runs")).resolve(), Path(scratch, "drawn"), wanted, given.accept)
    (HERE / "index.md").write_text("\n".join(page()).rstrip() + "\n", encoding="utf-8")
