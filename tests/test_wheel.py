"""A release's wheel has entries linked for its Python: the build hook makes them, with the systems of the tree that is built."""

import sys
from pathlib import Path

import pytest
from hatchling.metadata.core import ProjectMetadata
from hatchling.plugin.manager import PluginManager

ROOT = Path(__file__).parents[1]
MAKES = """
import sys
from importlib.metadata import distribution, entry_points
from pathlib import Path
assert distribution("nsmaps").version == "0"
names = [point.name for point in entry_points(group="nsmaps.systems") if point.dist.version == "0"]
Path("made").write_text(f"{'vi_pair' in names} {sys.version_info[:2]}")
Path(sys.argv[1]).mkdir()
Path(sys.argv[1], "one.xz").write_text("linked")
"""


@pytest.mark.parametrize(("version", "made"), [("standard", f"True {sys.version_info[:2]}"), ("editable", None)])
def test_entries_are_made_for_the_python_that_builds_except_for_editable_installs(version, made, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "tests" / "exact")
    from link_wheel import MAKE, LinkedEntries

    (tmp_path / MAKE).parent.mkdir(parents=True)
    (tmp_path / MAKE).write_text(MAKES)
    metadata, data = ProjectMetadata(str(ROOT), PluginManager()), {"pure_python": True, "force_include": {}}
    hook = LinkedEntries(str(tmp_path), {}, None, metadata, str(tmp_path), "wheel")
    hook.initialize(version, data)
    file = tmp_path / "made"
    assert (file.read_text() if file.exists() else None) == made
    included = data.pop("force_include")
    assert data == ({"pure_python": True} if made is None else {"pure_python": False, "infer_tag": True})
    assert list(included.values()) == ([] if made is None else ["nsmaps/exact/compiling/entries"])
    assert [Path(entries, "one.xz").read_text() for entries in included] == ([] if made is None else ["linked"])
    hook.finalize(version, data, "")
    assert not any(Path(entries).exists() for entries in included)
