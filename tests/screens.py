"""A terminal in the process of the tests: what is written to it, in lines."""

import re
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout, suppress
from io import StringIO
from typing import Any

import pytest

CODES = re.compile(r"\x1b\[[\d;?]*[a-zA-Z]|\x1b\][^\x1b]*\x1b\\")


class Terminal(StringIO):
    """A stream that somebody looks at."""

    def isatty(self) -> bool:
        """True."""
        return True


def lines_of(written: str) -> list[str]:
    """The lines of a text, without escape codes."""
    return CODES.sub("", written).replace("\r\n", "\n").split("\n")


def shown(width: int, call: Callable[[], Any]) -> list[str]:
    """The lines that a call writes to a terminal of a width, without colours; it may end the program."""
    terminal = Terminal()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(terminal), redirect_stderr(terminal), suppress(SystemExit):
        for name in ("FORCE_COLOR", "CI"):
            patch.delenv(name, raising=False)
        for name, value in (("TERM", "xterm"), ("NO_COLOR", "1"), ("COLUMNS", str(width))):
            patch.setenv(name, value)
        call()
    return lines_of(terminal.getvalue())
