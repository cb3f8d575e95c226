"""How much memory and disk does a vehicle take that stays up for a day, or flies for four hours?

Flies `honeyguide fly` in a process of its own, as fast as it goes, and looks at what the kernel accounts to it and at
its run folder. The pack of the vehicle that flies is a hundred times as large as an x500's, at the same weight.
Not part of `make bench`: a quarter of an hour on a quiet core.
"""

import os
import subprocess
import sys
import time
from pathlib import Path
from re import sub
from tempfile import TemporaryDirectory

from common.geodesy import DEFAULT_HOME, geodetic_from_ned

HOUR_S = 3600.0
AIRFRAME = Path(__file__).parents[1] / "common/airframes/x500.toml"
CAPACITY = r"(?m)^(capacity_mah\s*=\s*\{\s*value\s*=\s*)([\d.]+)"
CORNERS_NED = ((15.0, 0.0, -8.0), (15.0, 15.0, -10.0), (0.0, 15.0, -8.0), (0.0, 0.0, -12.0))
TAKEOFF, WAYPOINT, JUMP, RELATIVE, FOREVER = 22, 16, 177, 3, -1
MEMORY_MAX_MB = 1000.0


def main() -> int:
    with TemporaryDirectory() as folder:
        lap, airframe = Path(folder) / "lap.waypoints", Path(folder) / "large.toml"
        lap.write_text(_lap())
        airframe.write_text(sub(CAPACITY, r"\g<1>\g<2>e2", AIRFRAME.read_text()))
        flights = {
            "idle": (24.0, ["--idle"]),
            "flying": (4.0, ["--plan", str(lap), "--airframe", str(airframe), "--wind", "3"]),
        }
        return max(_soak(name, *flights[name], Path(folder) / name) for name in sys.argv[1:] or flights)


def _soak(name: str, hours: float, options: list[str], run: Path) -> int:
    command = [str(Path(sys.executable).with_name("honeyguide")), "fly", *options, "--speed", "max"]
    command += ["--seconds", str(hours * HOUR_S), "--run-folder", str(run)]
    start_s = time.perf_counter()
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as flight:
        _, status, usage = os.wait4(flight.pid, 0)
        flight.returncode = os.waitstatus_to_exitcode(status)
    memory_mb = usage.ru_maxrss * 1024 / 1e6
    print(f"{name}, {hours:g} simulated hours: {time.perf_counter() - start_s:.0f} s, exit code {flight.returncode}")
    print(f"  memory at most {memory_mb:.0f} MB (at most {MEMORY_MAX_MB:.0f})")
    for path in sorted(run.iterdir()):
        if path.is_file():
            print(f"  {path.name}: {path.stat().st_size / 1e6:.1f} MB")
    sys.stdout.flush()
    is_whole = (run / "flight.png").exists() and (run / "flight.ulg").exists()
    return 0 if is_whole and memory_mb < MEMORY_MAX_MB else 1


def _lap() -> str:
    """A mission that goes round for ever."""
    rows = [(TAKEOFF, (0.0, 0.0, -8.0)), *((WAYPOINT, corner) for corner in CORNERS_NED)]
    lines = ["QGC WPL 110", _line(0, 0, WAYPOINT, (0.0, 0.0, 0.0))]
    lines += [_line(k, RELATIVE, command, ned) for k, (command, ned) in enumerate(rows, 1)]
    lines.append(f"{len(rows) + 1}\t0\t2\t{JUMP}\t2\t{FOREVER}\t0\t0\t0\t0\t0\t1")
    return "\n".join(lines) + "\n"


def _line(number: int, frame: int, command: int, ned: tuple[float, float, float]) -> str:
    lat_deg, lon_deg, _ = geodetic_from_ned(*ned, DEFAULT_HOME)
    return f"{number}\t0\t{frame}\t{command}\t0\t0\t0\t0\t{lat_deg:.7f}\t{lon_deg:.7f}\t{-ned[2]:g}\t1"


if __name__ == "__main__":
    sys.exit(main())
