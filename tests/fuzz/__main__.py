"""`make fuzz`: broken frames and valid messages by the million; says how the vehicle bore it."""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from tests.fuzz.hover import HOLD_M, Hover

BROKEN_PER_FRAME = 32  # per station
VALID_PER_FRAME = 3
CHUNK = 50_000  # a flight for each: its battery lasts a quarter of an hour


def main() -> None:
    """Runs both kinds, each on new flights."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--frames", type=int, default=1_000_000, help="broken frames")
    parser.add_argument("--messages", type=int, default=100_000, help="valid messages")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--dialect", choices=("px4", "ardupilot"), default="px4")
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


if __name__ == "__main__":
    main()
