"""Hover: stay at a point two metres above home, by body rates and thrust, on the estimate alone.

In: an action at 50 Hz, held over five ticks. Out: what the flight controller's estimate tells, and a reward and an end
made from the truth, as the teacher sees it. An episode is a success if it lasts until its time is up.
"""

from typing import ClassVar, Literal

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.kernels import FRAME_TICKS, TICK_S
from policies.tasks.flight.flight_params import FLIGHT_PARAMS, FlightParams
from policies.tasks.flight.hover_bank import PLAIN
from policies.tasks.flight.rig_task import RigTask
from policies.tasks.flight.settings import RigSettings
from policies.tasks.hover.hover_kernels import (
    PARAMS,
    POINT_NED,
    RATE_MAX,
    HoverParams,
    HoverState,
    act,
    judge,
    place,
    prepare,
)
from policies.tasks.layout import Element, Layout
from policies.tasks.task_params import typed_rows
from policies.tasks.top_view import GOAL, VEHICLE, Canvas
from sim.world.world import build_world

HoverPreset = Literal["improved"]


class HoverSettings(RigSettings):
    """What a user may choose of Hover."""

    preset: HoverPreset = "improved"
    """`improved`: ours, the only one; no document describes this task."""


ACTIONS = (
    *(Element(f"{axis}_rate_sp", "rad/s", float(RATE_MAX[k])) for k, axis in enumerate(("roll", "pitch", "yaw"))),
    Element("thrust_sp", "1"),  # of the greatest thrust: -1 is none, 1 all
)
ELEMENTS = (
    *(Element(f"to_point_frd_{axis}", "m") for axis in "xyz"),
    *(Element(f"vel_frd_{axis}", "m/s") for axis in "xyz"),
    *(Element(f"down_frd_{axis}", "1") for axis in "xyz"),
    *(Element(f"omega_frd_{axis}", "rad/s") for axis in "xyz"),
    *(Element(f"last_{element.name}", "1") for element in ACTIONS),
)


class Hover(RigTask):
    """The task. Layout version 1."""

    params: ClassVar = PARAMS
    settings_class: ClassVar = HoverSettings
    decision_s = FRAME_TICKS * TICK_S

    def __init__(self, settings: HoverSettings, env_count: int, device: str = "cpu") -> None:
        super().__init__(
            Layout("Hover", 1, ELEMENTS, continuous=ACTIONS, stack=settings.stack or 1),
            env_count,
            build_world(PLAIN, device),
            has_estimator=settings.has_estimator,
            number_defaults={},
            device=device,
            split=settings.split,
        )
        self.settings = settings
        state = HoverState()
        state.flight = typed_rows(self.buffers.params, FlightParams)
        state.params = typed_rows(self.buffers.params, HoverParams, first=len(FLIGHT_PARAMS))
        state.actions = self._zeros("last_actions", env_count, wp.vec4)
        state.has_estimator = int(settings.has_estimator)
        start = self.start()
        self._starting: NDArray[np.bool_] = self.is_starting.numpy()  # live on a CPU
        buffers, rig = self.buffers, self.rig.arrays
        self._act = self.record(act, buffers, rig, state)
        self._judge = self.record(judge, buffers, rig, state, start)
        self._prepare = self.record(prepare, buffers, state, start)
        self._place = self.record(place, buffers, rig, state, start)

    def _launch_step(self) -> None:
        """What `step` does of the task's own."""
        self._act.launch()
        self.rig.advance(FRAME_TICKS)
        self._judge.launch()
        self._begin_rows()

    def _begin_rows(self) -> None:
        """Starts the episodes of the rows that are starting."""
        if self.device == "cpu" and not self._starting.any():
            return  # of a single vehicle a launch costs as much as its flight
        self._prepare.launch()
        self.take_off()
        self._place.launch()

    def top_view(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:
        """The ball, the point and the drone from above, north up."""
        ball_m = float(self.buffers.params.numpy()[i_env, self.param_table.names.index("ball_m")])
        pos_ned = self.rig.truth_row(i_env)["pos_ned"]
        edge = (-1.1 * ball_m, 1.1 * ball_m)
        canvas = Canvas(edge, edge, height_px)
        canvas.disc((0.0, 0.0), ball_m, (255, 255, 255))
        canvas.disc((0.0, 0.0), 0.05 * ball_m, GOAL)
        canvas.disc((float(pos_ned[1]), float(pos_ned[0])), 0.07 * ball_m, VEHICLE)
        canvas.text(f"{np.linalg.norm(pos_ned - np.array(POINT_NED)):4.2f} m from the point")
        return canvas.pixels
