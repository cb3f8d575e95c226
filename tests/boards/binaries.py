"""Real autopilots at their boards: where their binaries are, and flights by the command line, as a user would fly them.

None comes with the project: `make test-ardupilot SITL=FOLDER`, `make test-px4 PX4=FOLDER`, `make test-betaflight`.
"""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

HONEYGUIDE = Path(sys.executable).parent / "honeyguide"
PATIENCE_S = 1200.0  # of wall clock time, also on a machine that does other things
DEFAULTS = {"plane": "models"}  # where its file of defaults is, of what has it in a folder of its own


class Flown(NamedTuple):
    """A flight that is over."""

    exit_code: int
    output: str
    summary: dict[str, Any]
    """Figures, or the scorecard; empty if there is none."""


def ardupilot_command(folder: Path, binary: str) -> str:
    """Of a source folder that has been built."""
    vehicle = binary.removeprefix("ardu")
    defaults = folder / "Tools" / "autotest" / DEFAULTS.get(vehicle, "default_params") / f"{vehicle}.parm"
    return (
        f"{folder / 'build' / 'sitl' / 'bin' / binary} --model JSON --speedup 100 -I{{instance}} --home {{home}} "
        f"--defaults {defaults},{{params}}"
    )


def px4_command(folder: Path) -> str:
    """Of a build folder (px4_sitl_default)."""
    return f"{folder / 'bin' / 'px4'} -d -i {{instance}} -w {{folder}} -s etc/init.d-posix/rcS {folder / 'etc'}"


def flown(what: str, board: str, command: str, folder: Path, *options: str) -> Flown:
    """`honeyguide fly` or `follow`, to its end."""
    done = subprocess.run(
        [HONEYGUIDE, what, "--board", board, "--command", command, "--run-folder", folder, *options],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    path = folder / "summary.json"
    summary = json.loads(path.read_text()) if path.exists() else {}
    return Flown(done.returncode, done.stdout + done.stderr, summary)


def killed_in_flight(board: str, command: str, folder: Path, binary: str) -> Flown:
    """A flight whose autopilot is killed once it has said that it is armed."""
    process = subprocess.Popen(
        [HONEYGUIDE, "fly", "--board", board, "--command", command, "--run-folder", folder, "--once", "--speed", "max"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    lines = []
    for line in process.stdout:
        lines.append(line)
        if any(told in line for told in ("rming motors", "Armed by", "s  Armed")):
            _kill(binary, process.pid)
            break
    try:
        rest, _ = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
    return Flown(process.returncode, "".join(lines) + rest, {})


def _kill(binary: str, parent: int) -> None:
    """Kills the process of a binary that has this parent."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            program = (folder / "exe").readlink()
            of = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        if program.name == binary and of == parent:
            os.kill(int(folder.name), signal.SIGKILL)
            return
    raise LookupError(binary)
