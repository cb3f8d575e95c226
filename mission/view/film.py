"""The chase camera's film as a file.

In: a recording and its world. Out: an mp4, which takes its name when it is complete, and how far it is meanwhile: a bar
in a terminal, a line every few seconds elsewhere.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from common.clock import wall_time_s
from mission.console.option_checks import UserError
from mission.console.terminal import LINE_PERIOD_S, print_line
from mission.video.video_file import Mp4, VideoError
from mission.view.chase_camera import IMAGE_S, STRIDE
from mission.view.film_images import film
from mission.view.replay_file import Recording
from sim.world.world import WorldMap


def write_film(recording: Recording, world: WorldMap, target: Path, console: Console) -> None:
    """Chase view and onboard view as an mp4; says where it lies.

    Raises:
        UserError: it cannot be written.
    """
    count = len(recording.rows[::STRIDE])
    try:
        with Mp4(target, IMAGE_S) as mp4, reported(console, count) as tell:
            for i, image in enumerate(film(recording, world)):
                mp4.show(image)
                tell(i + 1)
    except VideoError as error:
        raise UserError(str(error)) from error
    print_line(console, f"film of {count * IMAGE_S:.0f} s: {target}")


@contextmanager
def reported(console: Console, count: int) -> Iterator[Callable[[int], None]]:
    """Inside, whoever gives the number of images done has it shown, with the time passed and left."""
    if console.is_terminal:
        columns = (TextColumn("film"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
        with Progress(*columns, console=console, transient=True) as progress:
            task = progress.add_task("film", total=count)
            yield lambda done: progress.update(task, completed=done)
        return
    start_s = shown_s = wall_time_s()

    def tell(done: int) -> None:
        nonlocal shown_s
        now_s = wall_time_s()
        if now_s - shown_s >= LINE_PERIOD_S:
            shown_s = now_s
            left_s = (now_s - start_s) * (count - done) / done
            print_line(console, f"film: picture {done} of {count}, {now_s - start_s:.0f} s, {left_s:.0f} s left")

    yield tell
