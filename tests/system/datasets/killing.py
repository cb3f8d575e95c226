"""Which processes there are to kill."""

from contextlib import suppress
from pathlib import Path


def processes_with(*words):
    """Process numbers whose command line has all these words."""
    found = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            line = (entry / "cmdline").read_bytes().decode(errors="replace") if entry.name.isdigit() else ""
            if line and all(word in line for word in words):
                found.append(int(entry.name))
    return found


def children(pid):
    """Process numbers of what a process started by multiprocessing."""
    found = []
    for number in processes_with("spawn_main"):
        with suppress(OSError):
            if f"\nPPid:\t{pid}\n" in Path(f"/proc/{number}/status").read_text():
                found.append(number)
    return found
