"""Links the engine for the Python that builds a wheel, so that its users compile less: `python -m build --wheel` of a release.

It takes minutes, and packages on which nsmaps depends, so it is done only where HATCH_BUILD_HOOKS_ENABLE=1.
"""

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

MAKE = Path("tests", "exact", "make_entries.py")


class LinkedEntries(BuildHookInterface):  # type: ignore[type-arg]
    """Puts linked entries into the wheel as files of `nsmaps/exact/compiling/entries`."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Make them, unless the installation is editable; the wheel is one of this Python and this platform."""
        if version == "editable":
            return
        self.folder = TemporaryDirectory()
        entries, about = Path(self.folder.name, "entries"), Path(self.folder.name, "nsmaps-0.dist-info")
        about.mkdir()  # by which the systems are found that plugins register
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: nsmaps\nVersion: 0\n", encoding="utf-8")
        (about / "entry_points.txt").write_text(self.registered(), encoding="utf-8")
        paths = os.pathsep.join([self.folder.name, self.root, str(Path(self.root, "plugins"))])
        command = [sys.executable, str(MAKE), str(entries)]
        subprocess.run(command, cwd=self.root, env={**os.environ, "PYTHONPATH": paths}, check=True)
        build_data["force_include"] |= {str(entries): "nsmaps/exact/compiling/entries"}
        build_data |= {"pure_python": False, "infer_tag": True}

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the files once they are in the wheel."""
        if version != "editable":
            self.folder.cleanup()

    def registered(self) -> str:
        """The entry points of pyproject.toml, as a package that is installed has them."""
        groups = self.metadata.core.entry_points
        return "\n".join(f"[{group}]\n" + "\n".join(f"{k} = {v}" for k, v in names.items()) for group, names in groups.items())
