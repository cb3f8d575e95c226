"""The live page of a flight: `honeyguide fly --view`.

In: a running flight, frame by frame, and what people click. Out: the page, at the address of its server. The flight's
thread reads a moment and hands it over, 15 times a second while a browser is open; sending happens on viser's threads.
Clicks wait in a queue for the flight's next frame: the vehicle is commanded by the flight's own MAVLink client.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from queue import Empty, Full, Queue

import numpy as np
import viser
from numpy.typing import NDArray

from autopilot.payload.camera.ports import RawFrame
from common.clock import wall_sleep_s, wall_time_s
from common.image_stream import ImageFrame
from mission.flight_base import FlightBase
from mission.view.controls import Controls
from mission.view.flight_snapshot import Moment, Row, moment_of
from mission.view.panel import PLOT_PERIOD_S, Panel
from mission.view.pose_goals import PoseGoals
from mission.view.scene import Mount, Scene, chase_of, overview_of
from mission.view.vehicle_nodes import wxyz_of
from sim.camera_rig import MOUNT_FRD, CameraRig

UPDATE_S = 1.0 / 15.0
STATUS_S = 0.25
PLOTS_S = 0.5
IMAGE_S = 0.2
PAUSE_S = 0.05  # how often a paused flight looks whether it may go on
TASKS_MAX = 64  # clicks that wait; what is beyond is not done
TASKS_PER_FRAME_MAX = 4
IMAGE_SIZE = (320, 180)
PHOTO_HFOV_DEG = 80.0
ENLARGED = 4  # a policy's image is small
RDF_IN_FRD = (0.5, 0.5, 0.5, 0.5)  # a camera that looks ahead


class LiveView:
    """The page of one flight.

    Args:
        flight: what is shown.
        server: of the page.
        speed: simulated seconds per second at which it begins; None: as fast as possible.
        path_ned: [m] (n, 3) way that it is to fly; empty without a plan.
        action: what a policy on board chose last.
        score: lines of text about how well it goes.
        goals: where its companion can be sent.
        others: other flights in its world, shown as well; who looks can choose whom status and controls are of.
        change_speed: sets the pace; None: the flight's own.
    """

    def __init__(
        self,
        flight: FlightBase,
        server: viser.ViserServer,
        *,
        speed: float | None = None,
        path_ned: Sequence[Sequence[float]] = (),
        action: Callable[[], Row | None] = lambda: None,
        score: Callable[[], tuple[str, ...]] = tuple,
        goals: PoseGoals | None = None,
        others: Sequence[FlightBase] = (),
        change_speed: Callable[[float | None], None] | None = None,
    ) -> None:
        self._flight, self._server, self._action, self._score = flight, server, action, score
        self._goals, self._others = goals, others
        self._todo: Queue[Callable[[], None]] = Queue(TASKS_MAX)
        self._camera = flight.controller.camera
        self._pixels: NDArray[np.uint8] | None = None  # newest image of the camera that a policy sees through
        mount = None if self._camera is None else Mount(MOUNT_FRD, RDF_IN_FRD, PHOTO_HFOV_DEG, *IMAGE_SIZE)
        if flight.onboard is not None:
            flight.onboard.add_sink(self._seen)
            mount = Mount(MOUNT_FRD, flight.onboard.q_frd_from_rdf, flight.onboard.hfov_deg, 1, 1)
        self._camera_rig = CameraRig(flight.rig, flight.world, has_thread=True)
        self._pending: Future[RawFrame] | None = None
        airframes = [other.airframe for other in others]
        self._scene = Scene(server, flight.world, flight.airframe, mount=mount, path_ned=path_ned, others=airframes)
        moment = self._moment()
        self._panel = Panel(server, has_owner=moment.has_owner, drives=self._scene.drives)
        pace = change_speed or flight.change_speed
        has_plan = len(path_ned) > 0
        self._controls = Controls(
            flight, server, self._add_task, speed, pace, has_plan=has_plan, goals=goals, others=others
        )
        self._chosen = flight
        for name, pose in () if goals is None else goals.named:
            self._scene.mark(name, pose)
        self._next_s = dict.fromkeys(("update", "status", "plots", "picture"), 0.0)
        self._next_point_s = 0.0
        self._text_count = 0  # of those that are shown
        self._restart_count = 0
        server.on_client_connect(lambda client: self._add_task(lambda: self._place_camera(client)))

    def frame(self) -> None:
        """Does what is due; the flight calls it after each of its frames, and waits here while it is paused."""
        self._do_what_was_clicked()
        while self._controls.is_paused:
            wall_sleep_s(PAUSE_S)
            self._do_what_was_clicked()
        if self._flight.time_us * 1e-6 >= self._next_point_s:
            self._next_point_s = self._flight.time_us * 1e-6 + PLOT_PERIOD_S
            self._panel.note(self._chosen_moment())
        if self._is_due("update", UPDATE_S) and self._server.get_clients():
            self._update()

    def _moment(self) -> Moment:
        return moment_of(self._flight, self._action())

    def _chosen_moment(self) -> Moment:
        return self._moment() if self._chosen is self._flight else moment_of(self._chosen)

    def end(self, text: str) -> None:
        """The flight is over: the page shows its last moment and this text, and clicks do nothing any more."""
        self._controls.disable()
        moment = self._moment()
        self._scene.show(moment, [moment_of(other) for other in self._others])
        self._show_texts(self._chosen_moment(), text)
        self._panel.draw_plots()
        self._server.flush()

    def close(self) -> None:
        """Ends the page."""
        self._camera_rig.close()
        self._server.stop()

    def _add_task(self, task: Callable[[], None]) -> None:
        with suppress(Full):
            self._todo.put_nowait(task)

    def _do_what_was_clicked(self) -> None:
        for _ in range(TASKS_PER_FRAME_MAX):
            try:
                task = self._todo.get_nowait()
            except Empty:
                return
            task()

    def _is_due(self, what: str, period_s: float) -> bool:
        now_s = wall_time_s()
        is_due = now_s >= self._next_s[what]
        if is_due:
            self._next_s[what] = now_s + period_s
        return is_due

    def _update(self) -> None:
        moment = self._moment()
        restart_count = sum(flight.restart_count for flight in (self._flight, *self._others))
        if restart_count != self._restart_count:
            self._restart_count = restart_count
            self._scene.forget_trails()
        others = [moment_of(other) for other in self._others]
        self._scene.extend_trails(moment, others)
        self._scene.show(moment, others)
        if self._goals is not None:
            self._scene.show_pose(self._goals.now())
        if self._controls.flight is not self._chosen:
            self._chosen, self._text_count = self._controls.flight, 0
        chosen = self._chosen_moment()
        obstacles = self._chosen.controller.state.obstacles
        self._scene.draw_rays(chosen, () if obstacles is None else obstacles.body_m or ())
        self._move_cameras(chosen)
        if self._is_due("status", STATUS_S):
            self._show_texts(chosen)
        if self._is_due("plots", PLOTS_S):
            self._panel.draw_plots()
        if self._is_due("picture", IMAGE_S):
            self._renew_image()

    def _show_texts(self, moment: Moment, *more: str) -> None:
        crash = ("the vehicle has crashed: Restart puts it back on its pad",) if self._chosen.is_crashed else ()
        self._panel.show_status(moment, (*more, *crash, *self._score(), *self._controls.lines))
        if self._chosen.texts.count > self._text_count:
            self._text_count = self._chosen.texts.count
            self._panel.show_texts(self._chosen.texts.since(0))

    def _seen(self, frame: ImageFrame) -> None:
        self._pixels = frame.pixels[..., :3]

    def _renew_image(self) -> None:
        if self._pixels is not None:
            self._show_image(self._pixels.repeat(ENLARGED, axis=0).repeat(ENLARGED, axis=1))
        if self._flight.onboard is not None:
            return
        if self._camera is None or (self._pending is not None and not self._pending.done()):
            return
        view = self._camera.view(IMAGE_SIZE, is_smooth=False)
        if self._scene.frustum is not None:
            self._scene.frustum.wxyz = wxyz_of(view.q_frd_from_rdf)
        self._pending = self._camera_rig.capture(view)
        self._pending.add_done_callback(self._show_taken)

    def _show_taken(self, future: "Future[RawFrame]") -> None:
        """On the camera's thread."""
        if not future.cancelled() and future.exception() is None:
            self._show_image(future.result().rgb)

    def _show_image(self, rgb: NDArray[np.uint8]) -> None:
        self._panel.show_image(rgb)
        if self._scene.frustum is not None:
            self._scene.frustum.image = rgb

    def _place_camera(self, client: viser.ClientHandle) -> None:
        moment = self._moment()
        if self._goals is not None and self._goals.named:
            eye_ned, target_ned = overview_of(moment, [pose[:2] for _, pose in self._goals.named])
        else:
            eye_ned, target_ned = chase_of(moment, drives=self._scene.drives)
        client.camera.up_direction = (0.0, 0.0, -1.0)
        client.camera.position = eye_ned
        client.camera.look_at = target_ned

    def _move_cameras(self, moment: Moment) -> None:
        """Keeps the vehicle in the middle of each viewer's image, seen from where they have turned to.

        Place and target of a viewer come in one message of their browser: however late it is, their difference holds.
        """
        if not self._controls.follows:
            return
        for client in self._server.get_clients().values():
            camera = client.camera
            offset = np.asarray(camera.position) - np.asarray(camera.look_at)
            with client.atomic():
                camera.position = moment.pos_ned + offset
                camera.look_at = moment.pos_ned
