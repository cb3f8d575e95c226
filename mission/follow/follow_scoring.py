"""How well a flight follows: the truth of its owner and its obstacles, for a scorecard.

In: a flight with an owner, frame by frame, whether somebody follows, and why it is somebody else who flies. Out: a
`Track` of what was followed, a sample for each decision; it ends with the planned time, with a collision, or when
nobody follows any more. Time in which a person has taken over, or has broken something, is not judged and not planned.
Nothing of the truth goes back to who flies.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import radians, tan

import numpy as np
import warp as wp
from numpy.typing import NDArray

from autopilot.interface.vehicle_state import Mode
from mission.flight_base import FlightBase
from policies.companion.engagement import Engagement
from policies.tasks.follow_me.measuring import COLUMNS, measure_rows
from policies.tasks.follow_me.observe import DECISION_S, HFOV_DEG, IMAGE_SIZE
from policies.tasks.follow_me.track import Ranges, Track
from sim.world.people import STATURE_M

PIXELS_LEAST = 2
VISIBLE_M = float(STATURE_M) * IMAGE_SIZE / (PIXELS_LEAST * 2.0 * tan(radians(0.5 * HFOV_DEG)))
"""Farther away a person is less than two pixels high: a policy cannot tell them from a trunk (guess)."""
_SAMPLE_US = round(DECISION_S * 1e6)
_BEFORE = (Mode.TAKEOFF, Mode.HOLD)  # on the way to being followed


def taken_over(flight: FlightBase, engagement: Engagement, *, has_begun: bool, is_put_back: bool) -> str:
    """Why it is a person who has the vehicle now; "" if the policy has it, or has given it up by itself.

    Args:
        flight: with a companion.
        engagement: of the companion.
        has_begun: it has followed before.
        is_put_back: it was restarted, and has not followed since.
    """
    if flight.injector.failures:
        return "a failure was injected"
    if is_put_back:
        return "the vehicle was restarted"
    state = flight.controller.state
    is_offboard = flight.controller.modes[state.mode].is_offboard
    is_own = is_offboard or engagement.has_chosen or (state.mode in _BEFORE and not has_begun)
    if is_own or state.is_failsafe or not state.is_armed:
        return ""
    return f"mode {state.mode.name.replace('_', ' ').title()} was chosen"


@dataclass(frozen=True, slots=True)
class Smoothness:
    """How calmly a vehicle moved."""

    accel_rms: float
    """[m/s²] level, of velocities a tenth of a second apart."""
    yaw_rate_rms: float
    """[deg/s]"""


class FollowWatch:
    """Watches vehicle 0 of a flight: call `frame` after each of the flight's.

    Args:
        flight: with an owner.
        is_following: whether somebody makes the vehicle follow now.
        planned_s: how long it is to follow.
        taken: why it is a person who has the vehicle now, given whether it has followed before; "": it is none.

    Raises:
        ValueError: the flight has no owner.
    """

    def __init__(
        self,
        flight: FlightBase,
        is_following: Callable[[], bool],
        planned_s: float,
        taken: Callable[[bool], str] = lambda _: "",
    ) -> None:
        if flight.owner is None:
            raise ValueError("there is nobody to follow in this flight")
        self._flight = flight
        self._is_following = is_following
        self._planned_s = planned_s
        self._taken = taken
        self._out = wp.zeros((1, len(COLUMNS)), dtype=float)
        self._row: NDArray[np.float32] = self._out.numpy()[0]  # live
        rig, cast, touch_m = flight.rig.arrays, flight.owner.cast.rows, Ranges().collision_m
        who = [cast.params, cast.people, cast.bystanders, cast.drawn]
        self._inputs = [rig.worlds, rig.i_world, rig.truth, *who, int(flight.drives), touch_m, self._out]
        self._rows: list[NDArray[np.float32]] = []
        self._sampled_us: list[int] = []  # of the flight, when each row was
        self._motion: list[tuple[float, float, float]] = []  # north, east [m/s], yaw rate [rad/s], of each row
        self._start_us = -1  # of the flight, when it began to follow; -1: not yet
        self._frame_us = 0  # when the last frame was
        self._judged_us = 0  # for so long it has followed
        self._is_paused = False
        self.takeovers: list[str] = []  # why people had the vehicle, each reason once
        self.is_over = False

    @property
    def has_begun(self) -> bool:
        """Whether it has followed."""
        return self._start_us >= 0

    @property
    def sample_count(self) -> int:
        """Samples taken so far."""
        return len(self._rows)

    @property
    def judged_s(self) -> float:
        """For so long it was flown by who follows."""
        return self._judged_us * 1e-6

    @property
    def paused_s(self) -> float:
        """For so long it was not, since it began."""
        return (self._frame_us - self._start_us - self._judged_us) * 1e-6 if self.has_begun else 0.0

    def begin(self) -> None:
        """It is to follow from now on, whether it does or not; otherwise that begins by itself."""
        self._start_us = self._frame_us = self._flight.time_us
        self._flight.rig.forget_impacts()

    def frame(self) -> None:
        """Looks for collisions, and takes a sample if one is due or the following is over."""
        if self.is_over:
            return
        is_following, taken = self._is_following(), self._taken(self.has_begun)
        if taken and taken not in self.takeovers:
            self.takeovers.append(taken)
        if not self.has_begun:
            if is_following and not taken:
                self.begin()
            return
        passed_us, self._frame_us = self._flight.time_us - self._frame_us, self._flight.time_us
        is_time_up = self._flight.time_us - self._start_us >= round(self._planned_s * 1e6)
        if taken or (self._is_paused and not is_following):
            self._is_paused = True
            self.is_over = is_time_up
            return
        if self._is_paused:
            self._is_paused = False
            self._flight.rig.forget_impacts()
        self._judged_us += passed_us
        self._look(is_left=not is_following, is_time_up=is_time_up)

    def _look(self, *, is_left: bool, is_time_up: bool) -> None:
        wp.launch(measure_rows, 1, self._inputs)
        has_collided = self._row[COLUMNS.index("is_collided")] > 0.5
        self.is_over = has_collided or is_left or is_time_up
        is_due = self._judged_us >= (len(self._rows) + 1) * _SAMPLE_US
        if is_due or has_collided or (is_left and not self._rows):
            self._rows.append(self._row.copy())
            self._sampled_us.append(self._flight.time_us)
            truth = self._flight.rig.rows["truth"][0]
            north, east, _ = truth["vel_ned"].tolist()
            self._motion.append((north, east, float(truth["omega_frd"][2])))

    @property
    def sampled_s(self) -> NDArray[np.float64]:
        """Simulated time of each sample."""
        return 1e-6 * np.array(self._sampled_us, dtype=np.float64)

    @property
    def motion(self) -> NDArray[np.float64]:
        """Of each sample: velocity north and east [m/s], yaw rate [rad/s], true; shape (samples, 3)."""
        return np.array(self._motion).reshape(-1, 3)

    @property
    def accel(self) -> NDArray[np.float64]:
        """Level acceleration [m/s²] from each sample to the next."""
        north, east, _ = self.motion.T
        return np.asarray(np.hypot(np.diff(north), np.diff(east)) / DECISION_S)

    def smoothness(self) -> Smoothness:
        """Of what was flown so far; zeros before the second sample."""
        if len(self._motion) < 2:
            return Smoothness(0.0, 0.0)
        accel, yaw_rate = self.accel, self.motion[:, 2]
        return Smoothness(float(np.sqrt(np.mean(accel**2))), float(np.degrees(np.sqrt(np.mean(yaw_rate**2)))))

    def track(self) -> Track | None:
        """What was followed of the planned time; none before the first sample."""
        return self._track(self._planned_s - self.paused_s)

    def so_far(self) -> Track | None:
        """The same if nothing more had been planned; once it is over, `track`."""
        return self.track() if self.is_over else self._track(self.judged_s)

    def _track(self, planned_s: float) -> Track | None:
        if not self._rows:
            return None
        distance, bearing, is_in_view, is_collided = np.array(self._rows, dtype=np.float64).T
        time_s = DECISION_S * np.arange(1, len(self._rows) + 1, dtype=np.float64)
        is_seen = (is_in_view > 0.5) & (distance < VISIBLE_M)
        return Track(time_s, distance, bearing, is_seen, is_collided > 0.5, planned_s)
