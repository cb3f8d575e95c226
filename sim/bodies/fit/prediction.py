"""What the multirotor's own kernels predict of logged segments, for many candidates of its airframe side by side.

In: segments, airframes, the wind of each flight. Out: velocities at the segments' ends, rates at their windows' ends.
Every row of the launch is one candidate in one segment, and each of its ticks is the body's `body_tick`, in air.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.airframes.multirotor import MultirotorAirframe
from common.kernels import vec8
from common.warp_start import start_warp
from sim.bodies.fit.segments import LEAD_TICKS, WINDOW_TICKS, WINDOWS, Segments
from sim.bodies.multirotor import body_at_rest, body_tick, density_ratio
from sim.bodies.multirotor_model import MultirotorModel, multirotor_model
from sim.world.world import World, WorldConfig, build_world

wp.set_module_options({"enable_backward": False})

_LEAD_TICKS = wp.constant(LEAD_TICKS)
_WINDOW_TICKS = wp.constant(WINDOW_TICKS)
_FLIGHT_TICKS = wp.constant(WINDOW_TICKS * WINDOWS)
_DOWN_M = wp.constant(-200.0)  # so high that no ground is near, whatever comes of a segment
_PLAIN = WorldConfig(size_m=50.0, hill_height_m=0.0, trees_per_ha=0.0)


@wp.struct
class LoggedRows:
    """`Segments` for the kernel."""

    log: wp.array(dtype=wp.int32)
    command: wp.array2d(dtype=vec8)
    voltage: wp.array2d(dtype=float)
    density_ratio: wp.array(dtype=float)
    vel_ned: wp.array2d(dtype=wp.vec3)
    q_ned_from_frd: wp.array2d(dtype=wp.quat)
    omega_frd: wp.array2d(dtype=wp.vec3)


@wp.kernel
def _predict(
    models: wp.array(dtype=MultirotorModel),
    winds_ned: wp.array2d(dtype=wp.vec3),
    logged: LoggedRows,
    worlds: wp.array(dtype=World),
    vel_ned: wp.array2d(dtype=wp.vec3),
    omega_frd: wp.array3d(dtype=wp.vec3),
) -> None:
    i_model, i_segment = wp.tid()
    model = models[i_model]
    wind_ned = winds_ned[i_model, logged.log[i_segment]]
    place_ned = wp.vec3(0.0, 0.0, _DOWN_M)
    model.home_density_ratio = 1.0  # and then that which makes the density at _DOWN_M the segment's
    model.home_density_ratio = logged.density_ratio[i_segment] / density_ratio(model, _DOWN_M)
    body = body_at_rest(model, place_ned, 0.0)
    ticks = int(_LEAD_TICKS + _FLIGHT_TICKS)
    for k in range(ticks):
        flown = k - _LEAD_TICKS
        body.pos_ned = place_ned
        body.q_ned_from_frd = logged.q_ned_from_frd[i_segment, k]
        body.battery_voltage_v = logged.voltage[i_segment, k] * model.battery.full_v
        if flown <= 0:
            body.vel_ned = logged.vel_ned[i_segment, k]
            body.vel_rounding_ned = wp.vec3()
        if flown < 0 or flown % _WINDOW_TICKS == 0:
            body.omega_frd = logged.omega_frd[i_segment, k]
        body = body_tick(model, body, logged.command[i_segment, k], wind_ned, worlds[0])
        if flown >= 0 and (flown + 1) % _WINDOW_TICKS == 0:
            omega_frd[i_model, i_segment, flown // _WINDOW_TICKS] = body.omega_frd
    vel_ned[i_model, i_segment] = body.vel_ned


class Predictor:
    """Predicts the same segments for candidates of one airframe after another.

    Args:
        segments: of logs.
    """

    def __init__(self, segments: Segments) -> None:
        start_warp()
        self._count, self._log_count = len(segments), segments.log_count
        self._world = build_world(_PLAIN)  # kept: the array below holds no more than addresses of its arrays
        self._worlds: Any = wp.array([self._world.kernel], dtype=World)
        rows = LoggedRows()
        rows.log = wp.array(segments.log, dtype=wp.int32)
        rows.command = wp.array(segments.command, dtype=vec8)
        rows.voltage = wp.array(segments.voltage, dtype=float)
        rows.density_ratio = wp.array(segments.density_ratio, dtype=float)
        rows.vel_ned = wp.array(segments.vel_ned, dtype=wp.vec3)
        rows.q_ned_from_frd = wp.array(segments.q_ned_from_frd, dtype=wp.quat)
        rows.omega_frd = wp.array(segments.omega_frd, dtype=wp.vec3)
        self._rows = rows

    def predict(
        self, airframes: Sequence[MultirotorAirframe], winds_ne: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        """What each candidate predicts.

        Args:
            airframes: the candidates.
            winds_ne: north and east of the wind of each flight [m/s], shape (candidates, logs, 2).

        Returns:
            Velocities at the end [m/s], shape (candidates, segments, 3), and rates at the windows' ends [rad/s],
            shape (candidates, segments, WINDOWS, 3), float64.
        """
        count = len(airframes)
        winds = np.zeros((count, self._log_count, 3), np.float32)
        winds[..., :2] = winds_ne
        models: Any = wp.array([multirotor_model(each) for each in airframes], dtype=MultirotorModel)
        vel_ned: Any = wp.zeros((count, self._count), dtype=wp.vec3)
        omega_frd: Any = wp.zeros((count, self._count, WINDOWS), dtype=wp.vec3)
        inputs = [models, wp.array(winds, dtype=wp.vec3), self._rows, self._worlds, vel_ned, omega_frd]
        wp.launch(_predict, dim=(count, self._count), inputs=inputs)
        return vel_ned.numpy().astype(float), omega_frd.numpy().astype(float)
