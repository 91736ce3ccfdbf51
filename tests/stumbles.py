"""A fault of Python 3.11 that tests with many threads meet now and then."""

import functools
import shutil
from collections.abc import Callable
from pathlib import Path

STUMBLE = "AST constructor recursion depth mismatch"  #: two threads that parse at once, as distributed's do


def again(test: Callable[[Path], None]) -> Callable[[Path], None]:
    """The test of a folder, begun anew, twice at most, where Python itself stumbled."""

    @functools.wraps(test)
    def tried(tmp_path: Path) -> None:
        for left in (2, 1, 0):
            try:
                return test(tmp_path)
            except SystemError as error:
                if STUMBLE not in str(error) or not left:
                    raise
                shutil.rmtree(tmp_path)
                tmp_path.mkdir()

    return tried
