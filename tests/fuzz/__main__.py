"""`make fuzz`: broken frames and valid messages by the million; says how the vehicle bore it.

Three kinds: broken frames, and valid messages that may not move it, to a vehicle that hovers; then extreme numbers,
all of them addressed to it, in every flight mode of both dialects.
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from autopilot.interface.vehicle_state import Mode
from tests.fuzz.hover import HOLD_M, Hover
from tests.fuzz.modes import FRAME_MAX_S, ModeFlight

BROKEN_PER_FRAME = 32  # per station
VALID_PER_FRAME = 3
DIALECTS = ("px4", "ardupilot")
MODE_CHUNK = 2_400  # two seconds of flight in a mode
CHUNK = 50_000  # a flight for each: its battery lasts a quarter of an hour


def main() -> None:
    """Runs all kinds, each on new flights."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--frames", type=int, default=1_000_000, help="broken frames")
    parser.add_argument("--messages", type=int, default=100_000, help="valid messages")
    parser.add_argument("--extreme", type=int, default=1_000_000, help="messages with extreme numbers, in every mode")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--dialect", choices=DIALECTS, default="px4", help="of the vehicle that hovers")
    options = parser.parse_args()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns) as progress:
        for kind, total, per_frame in (
            ("broken", options.frames, BROKEN_PER_FRAME),
            ("valid", options.messages, VALID_PER_FRAME),
        ):
            task = progress.add_task(kind, total=total)
            for start in range(0, total, CHUNK):
                folder = TemporaryDirectory()
                hover = Hover([options.seed, start, kind == "valid"], Path(folder.name), options.dialect)
                begin_us, begin_s = hover.flight.time_us, perf_counter()

                def show(sent: int, task: int = task, start: int = start) -> None:
                    progress.update(task, completed=start + sent)

                hover.send(min(CHUNK, total - start), kind, per_frame, show)
                behind = hover.work_off()
                progress.console.print(
                    f"{kind}: {hover.sent} sent in {(hover.flight.time_us - begin_us) * 1e-6:.0f} s simulated, "
                    f"{perf_counter() - begin_s:.0f} s of wall clock; moved {hover.truth_m:.3f} m in truth, "
                    f"{hover.estimate_m:.3f} m by its estimate (bound {HOLD_M} m); worst frame "
                    f"{1e3 * hover.worst_frame_s:.0f} ms; {behind} frames behind at the end"
                )
                hover.flight.close()
                folder.cleanup()
        fly_every_mode(progress, options.extreme, options.seed)


def fly_every_mode(progress: Progress, total: int, seed: int) -> None:
    """Keeps a vehicle of each dialect in one mode after the other, in rounds."""
    task = progress.add_task("extreme", total=total)
    for dialect in DIALECTS:
        flight = ModeFlight(seed, dialect)
        while flight.sent < total // len(DIALECTS):
            for mode in Mode:
                flight.send(mode, MODE_CHUNK)
                progress.advance(task, MODE_CHUNK)
        flight.close()
        frames, frames_in = sum(flight.frames.values()), sum(flight.frames_in.values())
        shares = {mode: flight.frames_in[mode] / flight.frames[mode] for mode in Mode}
        rarest = min(shares, key=lambda mode: shares[mode])
        progress.console.print(
            f"extreme, {dialect}: {flight.sent} in {len(shares)} modes, {frames} frames, {flight.flights} flights, "
            f"{100.0 * frames_in / frames:.0f} % in the mode meant, least in {rarest.name} "
            f"({100.0 * shares[rarest]:.0f} %); worst frame {1e3 * flight.worst_frame_s:.1f} ms "
            f"(bound {1e3 * FRAME_MAX_S:.0f} ms)"
        )
        if flight.worst_frame_s > FRAME_MAX_S:
            sys.exit(f"a frame took {1e3 * flight.worst_frame_s:.1f} ms")


if __name__ == "__main__":
    main()
