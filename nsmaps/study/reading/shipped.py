"""A study that an installed system ships, as a new file."""

from importlib.resources import files
from pathlib import Path

from nsmaps.errors import NsmapsError
from nsmaps.study.reading.reader import files_beside, shipped_file

MODELINE = "# yaml-language-server: $schema="  #: the first line of a study, which names its schema


def copy_study(name: str, to: Path | None = None) -> list[Path]:
    """Copy a shipped study to a file or into a folder, with the files that it refers to beside it; returns the paths written.

    The copy's first line names the schema of this installation. Its name is that of its file.

    Raises:
        StudyError: the study is not installed.
        NsmapsError: the file exists, or a file to which it refers exists with another content.
    """
    source = shipped_file(name)
    target = Path(source.name) if to is None else to / source.name if to.is_dir() else to
    lines = source.read_text(encoding="utf-8").splitlines(keepends=True)
    schema = Path(str(files("nsmaps.study").joinpath("schema.json"))).resolve().as_uri()
    text = "".join([f"{MODELINE}{schema}\n", *(lines[1:] if lines[0].startswith(MODELINE) else lines)])
    beside = {target.parent / file: (source.parent / file).read_text(encoding="utf-8") for file in files_beside(source)}
    for path, content in {target: None, **beside}.items():
        if path.exists() and content != path.read_text(encoding="utf-8"):
            raise NsmapsError(f"{path} is there already; expected: the name of a file that is not, as nsmaps copy {name} FILE")
    for path, content in {target: text, **beside}.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")
    return [target, *beside]
