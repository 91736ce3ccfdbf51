"""How to cite: the software, the paper whose method it implements, and a run."""

import hashlib
from pathlib import Path

AUTHORS = "The nsmaps developers"
TITLE = "nsmaps: global analysis of non-smooth dynamics by return maps, their surrogates and attracting domains"
PAPER = {
    "author": "Bao, Lanjing and Kuske, Rachel and Yurchenko, Daniil and Belykh, Igor",
    "title": "Computer-assisted global analysis for vibro-impact dynamics: a reduced smooth maps approach",
    "journal": "SIAM Journal on Applied Dynamical Systems",
    "volume": "24",
    "pages": "1891",
    "year": "2025",
}
_SPECIAL = {"\\": r"\textbackslash{}", **{letter: rf"\{letter}" for letter in "{}%&$#_"}, "~": r"\textasciitilde{}"}
_SPECIAL["^"] = r"\textasciicircum{}"


def citation(version: str) -> str:
    """BibTeX of the software, in this version, and of the paper."""
    software = {"author": f"{{{AUTHORS}}}", "title": TITLE, "version": version}
    return "\n".join([_entry("software", "nsmaps", software), _entry("article", "bao2025computer", PAPER)])


def run_citation(name: str, title: str, versions: dict[str, str], folder: Path) -> str:
    """BibTeX of a run, by its study and its versions, with a hash of the study and of its arrays."""
    hashes = [f"{file} {hashlib.sha256((folder / file).read_bytes()).hexdigest()[:16]}" for file in ("study.yaml", "arrays.npz")]
    note = (
        f"Study {name}; nsmaps {versions.get('nsmaps', '')}; system of {versions.get('system', '')}; sha256 {', '.join(hashes)}"
    )
    return _entry("misc", "run", {"title": _escaped(title or name), "note": _escaped(note)})


def _entry(kind: str, key: str, fields: dict[str, str]) -> str:
    lines = [f"  {name} = {{{value}}}," for name, value in fields.items()]
    return "\n".join([f"@{kind}{{{key},", *lines, "}"])


def _escaped(text: str) -> str:
    """The text as LaTeX prints it."""
    return "".join(_SPECIAL.get(letter, letter) for letter in text)
