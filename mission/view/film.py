"""The chase camera's film as a file.

In: a recording and its world. Out: an mp4, which takes its name when it is complete.
"""

from pathlib import Path

from rich.console import Console

from mission.options import UserError
from mission.video import Mp4, VideoError
from mission.view.chase import PICTURE_S, film
from mission.view.recording import Recording
from sim.world.world import WorldMap


def write_film(recording: Recording, world: WorldMap, target: Path, console: Console) -> None:
    """Chase view and onboard view as an mp4.

    Raises:
        UserError: it cannot be written.
    """
    try:
        with Mp4(target, PICTURE_S) as mp4, console.status("") as status:
            for i, picture in enumerate(film(recording, world)):
                mp4.show(picture)
                status.update(f"filming: {i * PICTURE_S:.0f} s")
    except VideoError as error:
        raise UserError(str(error)) from error
