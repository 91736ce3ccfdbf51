"""Maps and closed forms as files of other languages; the room is called itself: `nsmaps.export(result, "c")`."""

import os
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nsmaps.export.write import export as export
else:

    class _Room(ModuleType):
        """This package, which is public as a function too."""

        def __call__(self, result: Any, format: str, path: str | os.PathLike[str] | None = None) -> str | dict[str, str]:
            from nsmaps.export.write import export

            return export(result, format, path)

    export = sys.modules[__name__]
    export.__class__ = _Room
