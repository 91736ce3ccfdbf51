"""What a newcomer meets: help, completion, colours, progress, and plain text wherever nobody looks on."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import cache
from pathlib import Path

import pytest
from screens import Terminal, shown
from typer.main import get_command
from typer.testing import CliRunner

from nsmaps import read_result
from nsmaps.cli.cli import app
from nsmaps.cli.terminal import summary
from nsmaps.progress import clock

CODES = re.compile(r"\x1b")
CSI = re.compile(r"\x1b\[[\d;?]*[A-Za-z]")
COLOURS = re.compile(r"\x1b\[(?:\d+;)*(?:3[0-7]|9[0-7]|38;[\d;]+)(?:;\d+)*m")
COMMANDS = sorted(get_command(app).commands)
HELP = ["--help"], *([name, "--help"] for name in COMMANDS)


def environment(**more: str) -> dict[str, str]:
    """This process's own, with its path, and without what would speak for or against colours."""
    kept = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "FORCE_COLOR", "TERM", "COLUMNS", "CI")}
    return {**kept, "PYTHONPATH": os.pathsep.join(sys.path), "TERM": "xterm-256color", **more}


def interruptible() -> None:
    """Ctrl-C reaches a program also where these tests run behind a shell that ignores it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def program(*arguments: str, **more: str) -> "subprocess.CompletedProcess[str]":
    """The program in a process of its own, its output in pipes."""
    command = [sys.executable, "-m", "nsmaps", *arguments]
    return subprocess.run(command, capture_output=True, text=True, env=environment(**more), check=False)


def on_terminal(*arguments: str, stop_at: str = "\0", **more: str) -> tuple[int, str]:
    """The exit code and all that the program writes to a terminal, on which Ctrl-C is pressed once a text appears."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "nsmaps", *arguments]
    running = subprocess.Popen(
        command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment(**more), preexec_fn=interruptible
    )
    os.close(theirs)
    written, pressed = "", False
    with suppress(OSError), os.fdopen(ours, "rb", buffering=0) as screen:  # which ends in an error on Linux
        while part := screen.read(65536):
            written += part.decode(errors="replace")
            if stop_at in written and not pressed:
                running.send_signal(signal.SIGINT)
                pressed = True
    return running.wait(), written


@pytest.fixture
def looked_at(monkeypatch: pytest.MonkeyPatch, good: str) -> Callable[..., tuple[int, str]]:
    """A run on a terminal of this process, which shows progress at once and often: the exit code and all that is written."""
    Path("s.yaml").write_text(good.replace("n_returns: 5", "n_returns: 100000"))
    monkeypatch.setattr("nsmaps.cli.terminal.SOON", 0.001)
    monkeypatch.setattr("nsmaps.progress.EVERY", 0.01)
    monkeypatch.setenv("TERM", "xterm-256color")
    for name in ("NO_COLOR", "FORCE_COLOR", "COLUMNS", "CI"):
        monkeypatch.delenv(name, raising=False)

    def invoked(*options: str) -> tuple[int, str]:
        screen = Terminal()
        with redirect_stdout(screen), redirect_stderr(screen), pytest.raises(SystemExit) as ended:
            app(["run", "s.yaml", "--no-figures", *options], prog_name="nsmaps")
        return ended.value.code, screen.getvalue()

    return invoked


def test_times_are_told_as_a_clock() -> None:
    assert [clock(seconds) for seconds in (0, 7.2, 59.9, 61, 3725)] == ["0:00", "0:08", "1:00", "1:01", "1:02:05"]


def test_help_teaches_by_examples_that_name_the_command() -> None:
    for name, command in get_command(app).commands.items():
        assert f"$ nsmaps {name}" in command.epilog, f"nsmaps {name} --help shows no example"
        assert command.help, f"nsmaps {name} --help says nothing"
        silent = [option.opts for option in command.params if not option.help]
        assert silent == [], f"nsmaps {name}: options without a word"


def test_examples_of_help_are_accepted() -> None:
    for command in get_command(app).commands.values():
        for line in re.findall(r"^\$ nsmaps ([^|>\n]*)", command.epilog, re.MULTILINE):
            name, *given = line.split()
            get_command(app).commands[name].make_context(name, [word for word in given if word != "--help"])


@pytest.mark.parametrize("given", HELP, ids=lambda given: given[0])
def test_piped_help_has_no_escape_codes(given: list[str]) -> None:
    done = CliRunner().invoke(app, given, color=True, env={"TERM": "xterm-256color", "NO_COLOR": None, "FORCE_COLOR": None})
    assert done.exit_code == 0
    assert len(done.output) > 200
    assert not CODES.search(done.output)


@cache
def piped_help() -> "subprocess.CompletedProcess[str]":
    """What the program says of itself."""
    return program("--help")


def test_piped_help_of_the_program_has_no_escape_codes() -> None:
    done = piped_help()
    assert done.returncode == 0
    assert not CODES.search(done.stdout + done.stderr)


def test_a_piped_run_has_no_escape_codes_and_no_progress(looked_at: Callable[..., tuple[int, str]]) -> None:
    """Where a terminal would show progress."""
    assert "orbits (4 of 5)" in looked_at()[1]
    done = CliRunner().invoke(app, ["run", "s.yaml", "--no-figures"])
    assert done.exit_code == 0
    assert not CODES.search(done.stdout)
    assert done.stderr == ""


def test_no_color_is_obeyed_on_a_terminal(looked_at: Callable[..., tuple[int, str]], monkeypatch: pytest.MonkeyPatch) -> None:
    assert "report runs/s/report.html" in re.sub(r"\s+", " ", CSI.sub("", looked_at()[1]))
    monkeypatch.setenv("NO_COLOR", "1")
    code, written = looked_at()
    assert code == 0
    assert "orbits (4 of 5)" in written
    assert not COLOURS.search(written)
    assert not COLOURS.search(on_terminal("run", "--help", NO_COLOR="1")[1])
    assert COLOURS.search(on_terminal("run", "--help")[1]), "where it is not set there are colours"


def test_quiet_is_quiet_on_a_terminal(looked_at: Callable[..., tuple[int, str]]) -> None:
    assert looked_at("--quiet") == (0, "")


def test_a_terminal_sees_progress_and_ctrl_c_keeps_what_is_done_and_says_how_to_go_on(good: str) -> None:
    Path("s.yaml").write_text(good.replace("n_returns: 5", "n_returns: 8000000"))
    code, written = on_terminal("run", "s.yaml", "--out", "out", stop_at="left of orbits")
    assert code == 130
    assert "orbits (4 of 5)" in written
    assert re.search(r"\d+:\d\d left of orbits", written)
    assert "to resume: nsmaps run s.yaml --out out --resume" in written
    kept = read_result("out")
    assert not kept.finished
    assert "orbits" not in kept.timings
    assert CliRunner().invoke(app, ["report", "out"]).exit_code == 0
    assert "Unfinished: the run was stopped" in Path("out/report.html").read_text()


def complete(line: str) -> list[str]:
    """What the shell is offered at the end of a line."""
    words = line.split(" ")
    asked = {"_NSMAPS_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)}
    return CliRunner().invoke(app, env=asked, prog_name="nsmaps").stdout.split()


def test_the_shell_completes_commands_options_and_studies() -> None:
    assert complete("nsmaps sc") == ["schema"]
    assert complete("nsmaps run --res") == ["--resume"]
    assert complete("nsmaps run ball/") == ["ball/drop"]
    assert "--install-completion" in piped_help().stdout


def test_a_command_that_is_not_there_has_a_near_match() -> None:
    done = CliRunner().invoke(app, ["chekc"])
    assert done.exit_code == 2
    assert "check" in done.stderr


def test_check_says_where_and_what_was_meant() -> None:
    Path("s.yaml").write_text("system: ball\nparameters: {a: 0.2}\norbit: []\n")
    done = CliRunner().invoke(app, ["check", "s.yaml"])
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr.startswith("s.yaml:3:1: unknown key 'orbit', did you mean 'orbits'?; expected: name, title, system")


def piped(*arguments: str, reads: int) -> "subprocess.CompletedProcess[str]":
    """The program with a reader that closes the pipe after some bytes."""
    command = [sys.executable, "-u", "-m", "nsmaps", *arguments]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment())
    assert running.stdout is not None
    assert running.stderr is not None
    running.stdout.read(reads)
    running.stdout.close()
    error = running.stderr.read().decode()
    return subprocess.CompletedProcess(command, running.wait(), "", error)


@pytest.mark.skipif(os.name != "posix", reason="pipes as POSIX has them")
def test_a_reader_that_stops_is_no_error() -> None:
    done = piped("systems", reads=1)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("given", [["check", "ball/drop"], ["--help"]], ids=lambda given: given[0])
def test_a_full_disk_is_told_once(given: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "nsmaps", *given]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, env=environment(), check=False)
    assert (done.returncode, done.stderr) == (2, "the output cannot be written: No space left on device\n")


def test_a_run_ends_with_what_its_verdicts_come_to(good: str) -> None:
    Path("s.yaml").write_text(good)
    lines = CliRunner().invoke(app, ["run", "s.yaml", "--no-figures"], env={"COLUMNS": "80"}).stdout.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80
    assert "  100 %  of the grid lies in a piece of the composite map" in lines
    assert "report  runs/s/report.html" in lines
    told = "The one required verdict holds. Of 6 that are not required, "
    (number,) = [number for number, line in enumerate(lines) if line.startswith(told)]
    assert lines[number + 1].startswith("orbit from (v = 0.3, phi = 1): "), "the first of those that fail unexpectedly"
    whole = CliRunner().invoke(app, ["show", "runs/s", "--verdicts"]).stdout.splitlines()
    (number,) = [number for number, line in enumerate(whole) if line.startswith(told)]
    assert not any("domain exact: converged" in line for line in whole[number + 4 :]), "the conclusion stands last"
    assert any("domain exact: converged" in line for line in whole[:number])
    Path("t.yaml").write_text(good.replace("where: v > 0.2,", "where: v > 0.3,"))
    done = CliRunner().invoke(app, ["run", "t.yaml", "--no-figures"])
    assert done.exit_code == 1
    assert "1 of 1 required verdicts fails: covered (composite map)." in done.stdout


def verdict(lines: list[str], width: int) -> tuple[str, str]:
    """The line of a verdict and the one above it."""
    told = "every state of the grid lies in a piece"
    (number,) = (k for k, line in enumerate(lines) if told in line)
    assert max(len(line) for line in lines if told in line) <= width
    return lines[number], lines[number - 1]


def test_verdicts_stand_below_their_names_on_a_narrow_terminal(good: str) -> None:
    Path("s.yaml").write_text(good)
    app(["run", "s.yaml", "--no-figures", "--no-report"], prog_name="nsmaps", standalone_mode=False)
    made = read_result("runs/s")
    for width, narrow in ((80, True), (120, True), (160, True), (161, False), (200, False)):
        line, above = verdict(shown(width, lambda: summary(made, Path("runs/s"), with_verdicts=True)), width)
        assert ("covered (composite map, required)" in above) is narrow
        assert ("covered" in line) is not narrow
