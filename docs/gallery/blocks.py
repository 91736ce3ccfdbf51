"""The Python blocks of a page, and the pictures that they save."""

import doctest
import re
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path

FENCE = re.compile(r"^```(python|yaml)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# file: (\S+)\n")  #: with which a block that is a file begins


def python_of(page: Path) -> Iterator[str]:
    """The Python blocks of a page that are no files, as programs."""
    for language, text in FENCE.findall(page.read_text(encoding="utf-8")):
        if language == "python" and not FILE.match(text):
            examples = doctest.DocTestParser().get_examples(text)
            yield "".join(example.source for example in examples) or text


def run(page: Path, folder: Path, dpi: float) -> None:
    """Write the blocks that are files to a folder, and execute the others there; pictures are saved there too."""
    from matplotlib import rc_context

    folder.mkdir(parents=True, exist_ok=True)
    for _, text in FENCE.findall(page.read_text(encoding="utf-8")):
        if named := FILE.match(text):
            (folder / named[1]).write_text(text, encoding="utf-8")
    with chdir(folder), rc_context({"savefig.dpi": dpi}):
        exec("".join(python_of(page)), {"__name__": page.stem})
