"""On a narrow terminal lines end between words, whatever is printed, and no word is cut."""

import json
import os
import struct
import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
from screens import lines_of, shown
from typer.main import get_command
from typer.testing import CliRunner

from nsmaps.cli.cli import app
from nsmaps.cli.terminal import show_markdown

ROOT = Path(__file__).parents[2]
STORED = ROOT / "tests" / "data" / "run-format-4"
FRAME = "│╭╮╰╯─┃━*"
WIDE = 150  #: columns, in which hardly a line is broken, and what verdicts say stands below their names
COMMANDS = {
    "systems": ["systems"],
    "check": ["check", "vi_pair/cd"],
    "a wrong study": ["check", "vi_pair/cdd"],
    "bench": [],
    **{f"show {path.name}": ["show", str(path), "--verdicts"] for path in sorted(STORED.iterdir())},
    **{f"{name} --help": [name, "--help"] for name in sorted(get_command(app).commands)},
}
PROGRAM = """\
import json, sys
from contextlib import suppress
from nsmaps.cli.cli import app

for words in json.loads(sys.argv[1]):
    with suppress(SystemExit):
        app(words, prog_name="nsmaps")
    print(end="\\0", flush=True)
"""


@cache
def table() -> str:
    """The text with a table in Markdown that `nsmaps bench` prints."""
    return (ROOT / "docs" / "benchmarks" / "bench.txt").read_text()


def screen(width: int, *arguments: str) -> list[str]:
    """The lines that a command, or the table of `nsmaps bench` without one, writes to a terminal of a width."""
    return shown(width, lambda: app(arguments, prog_name="nsmaps") if arguments else show_markdown(table()))


def of_a_program(width: int, *commands: list[str]) -> list[list[str]]:
    """The lines that each command of a program writes to a terminal, which tells its width."""
    pty, fcntl, termios = (pytest.importorskip(name) for name in ("pty", "fcntl", "termios"))
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 60, width, 0, 0))
    kept = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES", "FORCE_COLOR", "CI")}
    environment = {**kept, "PYTHONPATH": os.pathsep.join(sys.path), "TERM": "xterm", "NO_COLOR": "1"}
    command = [sys.executable, "-c", PROGRAM, json.dumps(commands)]
    running = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment)
    os.close(theirs)
    written = b""
    with suppress(OSError), os.fdopen(ours, "rb", buffering=0) as output:  # which ends in an error on Linux
        while part := output.read(65536):
            written += part
    running.wait()
    return [lines_of(each) for each in written.decode().split("\0")]


def words(lines: list[str]) -> set[str]:
    """The words of some lines, without frames and the marks at their ends."""
    plain = "\n".join(lines).translate(str.maketrans(FRAME, " " * len(FRAME)))
    return {word.strip(".,;:()[]") for word in plain.split()} - {""}


@pytest.mark.parametrize("command", COMMANDS)
def test_no_word_is_broken_and_none_is_lost(command: str) -> None:
    whole = screen(WIDE, *COMMANDS[command])
    for width in (60,) if "--help" in command else (80, 60):
        lines = screen(width, *COMMANDS[command])
        longest = max(words(whole), key=len)
        assert max(map(len, lines)) <= max(width, len(longest) + 4), max(lines, key=len)
        assert words(lines) - words(whole) == set()
        if "--help" not in command:  # whose tables have a head of their own
            assert words(whole) - words(lines) == set()


@pytest.mark.thorough
def test_a_terminal_of_a_program_shows_the_same() -> None:
    commands = [COMMANDS[command] for command in ("check", "show run", "run --help", "a wrong study")]
    *lines, end = of_a_program(60, *commands)
    assert lines == [screen(60, *command) for command in commands]
    assert end == [""]


def test_a_broken_word_is_seen() -> None:
    assert words(["a pair", "of wo", "rds │ x"]) - words(["a pair of words x"]) == {"wo", "rds"}


def test_what_is_piped_keeps_its_lines_without_a_width() -> None:
    piped, narrow = (CliRunner().invoke(app, ["check", "vi_pair/cd"], env={"COLUMNS": width}).stdout for width in (None, "60"))
    (line,) = [line for line in piped.split("\n") if line.startswith("  composite: ")]
    assert len(line) > 100
    assert max(map(len, narrow.split("\n"))) <= 60
