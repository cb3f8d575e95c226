"""`honeyguide replay`: a finished run in the live page's scene, with a slider for the time.

In: the log in a run folder. Out: the page until Ctrl-C, or one HTML file, or a film; nothing of the run changes.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import viser
from rich.console import Console

from common.airframe import load_airframe
from common.clock import wall_sleep_s, wall_time_s
from common.kernels import FRAME_US
from mission.console.option_checks import UserError
from mission.simulator.flight_rig import flight_world
from mission.view.film import write_film
from mission.view.html import write_html
from mission.view.panel import PLOT_PERIOD_S, Panel
from mission.view.replay_file import Recording, RecordingError, load_recording
from mission.view.scene import Mount, Scene, chase_of
from mission.view.snapshot_images import onboard_eye
from policies.tasks.follow_me.observe import HFOV_DEG, camera_mount
from sim.camera_rig import MOUNT_FRD
from sim.world.world import WorldMap

UPDATE_S = 0.05
SLOW_UPDATES = 6  # updates of the scene per update of trails, image and text
ENLARGED = 4
TRAIL_FRAMES = 12
PACES = {"1/2 x": 0.5, "1 x": 1.0, "2 x": 2.0, "5 x": 5.0}


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """The options of `honeyguide replay`, as given."""

    run: Path
    html: Path | None
    mp4: Path | None
    view_port: int


def replay(options: ReplayOptions, console: Console) -> None:
    """Shows a run, or writes what is asked for.

    Raises:
        UserError: there is no such run, or a file or port cannot be used.
    """
    try:
        recording = load_recording(options.run)
    except RecordingError as error:
        raise UserError(str(error)) from error
    world = flight_world(recording.config)
    if options.html is not None:
        try:
            write_html(recording, world, options.html, title_of(recording))
        except OSError as error:
            raise UserError(f"--html {options.html}: {error.strerror}") from error
    if options.mp4 is not None:
        write_film(recording, world, options.mp4, console)
    if options.html is None and options.mp4 is None:
        from mission.connections import open_page

        page = open_page(options.view_port)
        console.print(f"replay: {page.url} (Ctrl-C ends it)", highlight=False, soft_wrap=True)
        view = ReplayView(recording, world, page)
        try:
            while True:
                view.frame()
                wall_sleep_s(UPDATE_S)
        except KeyboardInterrupt:
            view.close()


def title_of(recording: Recording) -> str:
    """What was flown, in a line."""
    config = recording.config
    name = load_airframe(config.airframe).name
    owner = "" if config.owner is None else f", the owner {config.owner.pace}s"
    others = f" and {len(recording.others)} more" if recording.others else ""
    return f"{name}{others}, wind {config.wind_m_s:g} m/s, seed {config.seed}{owner}"


class ReplayView:
    """The page of one recording."""

    def __init__(self, recording: Recording, world: WorldMap, server: viser.ViserServer) -> None:
        self._recording, self._server = recording, server
        mount = Mount(MOUNT_FRD, camera_mount(), HFOV_DEG, 1, 1)
        airframe = load_airframe(recording.config.airframe)
        others = [load_airframe(other.config.airframe) for other in recording.others]
        self._scene = Scene(server, world, airframe, mount=mount, path_ned=recording.path_ned.tolist(), others=others)
        self._panel = Panel(server, has_owner=recording.has_owner, drives=self._scene.drives)
        self._eye = onboard_eye(world)
        for row in recording.every(round(PLOT_PERIOD_S * 1e6 / FRAME_US)).rows:
            self._panel.note_row(row)
        self._panel.draw_plots()
        self._times: Any = recording.rows["time_s"]
        first, last = float(self._times[0]), float(self._times[-1])
        gui = server.gui
        self._time: Any = gui.add_slider(
            "Time [s]", min=first, max=max(last, first + 0.1), step=0.02, initial_value=first
        )
        self._play = gui.add_checkbox("Play", initial_value=True)
        self._pace = gui.add_dropdown("Pace", tuple(PACES), initial_value="1 x")
        self._wall_s = wall_time_s()
        self._count = 0
        self._shown = -1
        server.on_client_connect(self._place_camera)

    def frame(self) -> None:
        """Shows the moment whose turn it is."""
        now_s = wall_time_s()
        passed_s, self._wall_s = now_s - self._wall_s, now_s
        if self._play.value and self._server.get_clients():
            pace = PACES.get(self._pace.value, 1.0)
            self._time.value = min(self._time.value + passed_s * pace, float(self._times[-1]))
        index = min(int(np.searchsorted(self._times, self._time.value)), len(self._times) - 1)
        self._count += 1
        if self._count % SLOW_UPDATES == 0:
            self._show_slow(index)
        if index != self._shown:
            if abs(index - self._shown) > 2 * TRAIL_FRAMES:
                self._draw_trails(index)
            self._shown = index
            others = [other.moment(index) for other in self._recording.others]
            self._scene.show(self._recording.moment(index), others)

    def _show_slow(self, index: int) -> None:
        moment = self._recording.moment(index)
        self._panel.show_status(moment, (title_of(self._recording),))
        self._draw_trails(index)
        self._eye.look_from(self._recording.rows[index])
        self._panel.show_image(self._eye.rgb.repeat(ENLARGED, axis=0).repeat(ENLARGED, axis=1))

    def _draw_trails(self, index: int) -> None:
        past = slice(0, index + 1, TRAIL_FRAMES)
        others = [other.rows[past] for other in self._recording.others]
        self._scene.draw_trails(self._recording.rows[past], others)

    def _place_camera(self, client: viser.ClientHandle) -> None:
        eye_ned, target_ned = chase_of(self._recording.moment(max(self._shown, 0)), drives=self._scene.drives)
        client.camera.up_direction = (0.0, 0.0, -1.0)
        client.camera.position = eye_ned
        client.camera.look_at = target_ned

    def close(self) -> None:
        """Ends the page."""
        self._server.stop()
