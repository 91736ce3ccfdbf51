"""Commands of a changed nsmaps, one after another in a process of its own."""

import json
import os
import subprocess
import sys
from pathlib import Path

PROGRAM = """
import json, sys
from typer.testing import CliRunner
from nsmaps.cli.cli import app

done = [CliRunner().invoke(app, words) for words in json.loads(sys.argv[1])]
json.dump([(each.exit_code, each.stdout, each.stderr) for each in done], sys.stdout)
"""


def told(folder: Path, *commands: list[str], first: str = "") -> list[tuple[int, str, str]]:
    """What commands end with and print in a folder, whose modules are found before all others, after a line of Python."""
    command = [sys.executable, "-c", first + PROGRAM, json.dumps(commands)]
    env = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder.resolve()), *sys.path])}
    return json.loads(subprocess.run(command, cwd=folder, env=env, stdout=subprocess.PIPE, text=True, check=True).stdout)
