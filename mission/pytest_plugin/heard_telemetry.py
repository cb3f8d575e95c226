"""What a vehicle says of itself over a link, as checks see a flight: they take it for the truth.

In: the newest messages of its client. Out: the history of the flight, texts and items reached with their times, and how
it stands in the end.
"""

from math import isnan, nan
from typing import Any

import numpy as np

from autopilot.interface.vehicle_state import LandedState, Mode
from autopilot.mavlink.dialects import Dialect, UnknownModeError
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.wire.codec import message_id
from common.airframe import DEFAULT_VEHICLE
from common.attitude import quat_of_roll_pitch_yaw
from common.clock import wall_time_s
from mission.boards.outside_controller import NEEDED_HZ, RATES_HZ
from mission.log.flight_recorder import HISTORY, History
from mission.script import GROUND_ROVER, Drone
from sim.bodies.vehicles import VEHICLES

JUDGED = frozenset(
    {
        *("altitude", "speed", "climb", "tilt", "corridor", "near", "away", "arrives", "duration", "modes", "heard"),
        *("not_heard", "at_end", "reached", "always", "once"),
    }
)
"""The checks that can be judged by it."""
ASK_AGAIN_S = 5.0  # of wall clock time
ARDUPILOT_ID, FIXED_WING = 3, 1  # MAV_AUTOPILOT, MAV_TYPE
_SET_MESSAGE_INTERVAL = 511


class HeardTelemetry:
    """One vehicle's; in the place of a flight, and of who hears it, for those that judge.

    Args:
        drone: its client.
        autopilot: MAV_AUTOPILOT.
    """

    world, is_crashed = None, False

    def __init__(self, drone: Drone, autopilot: int) -> None:
        self.drone = drone
        self.texts: list[tuple[float, str]] = []  # [s]
        self.reached: list[tuple[float, int]] = []
        self.touches: list[tuple[float, float, bool]] = []
        self.time_us = 0
        self.is_known = False
        """It has told where it is."""
        self._dialect: Dialect = ARDUPILOT if autopilot == ARDUPILOT_ID else PX4
        self._rows: list[tuple[Any, ...]] = []
        self._mode, self._modes_of = Mode.HOLD, -1
        self._next_ask_s = 0.0
        self._counts = [0, 0]  # of the client's texts and items reached

    @property
    def drives(self) -> bool:
        return self.drone.drives

    @property
    def controller(self) -> "HeardTelemetry":
        return self

    @property
    def state(self) -> "HeardTelemetry":
        return self

    @property
    def landed_state(self) -> LandedState:
        landed = self.drone.latest("EXTENDED_SYS_STATE")
        return LandedState.ON_GROUND if landed is None else LandedState(landed.landed_state or LandedState.ON_GROUND)

    def frame(self) -> None:
        """Takes in what has been heard."""
        drone = self.drone
        self._ask()
        self.texts += [(self.time_us * 1e-6, text) for text in drone.texts[self._counts[0] :]]
        self._counts[0] = len(drone.texts)
        if len(drone.reached) < self._counts[1]:  # another mission
            self._counts[1] = 0
        self.reached += [(self.time_us * 1e-6, seq) for seq in drone.reached[self._counts[1] :]]
        self._counts[1] = len(drone.reached)
        attitude = drone.latest("ATTITUDE")
        if attitude is None or isnan(drone.pos_ned[0]) or drone.time_us == self.time_us:
            return
        self.time_us, self.is_known = drone.time_us, drone.latest("HEARTBEAT") is not None
        q = quat_of_roll_pitch_yaw(attitude.roll, attitude.pitch, attitude.yaw)
        mission = drone.latest("MISSION_CURRENT")
        moment = (drone.pos_ned, drone.vel_ned, q)
        seq = 0 if mission is None else mission.seq
        self._rows.append((self.time_us, *moment, *moment, drone.is_armed, int(self._flight_mode()), seq, nan, nan))

    def history(self) -> History:
        """All of it, as columns."""
        rows = np.array(self._rows, HISTORY)
        return History(**{name: rows[name] for name in HISTORY.names})  # type: ignore[union-attr]

    def _ask(self) -> None:
        """For messages that an autopilot may not send by itself."""
        drone = self.drone
        if wall_time_s() < self._next_ask_s:
            return
        self._next_ask_s = wall_time_s() + ASK_AGAIN_S
        for name, rate_hz in {**RATES_HZ, **dict.fromkeys(drone.needs, NEEDED_HZ)}.items():
            params = {"param1": float(message_id(name)), "param2": 1e6 / rate_hz}
            drone.ask("COMMAND_LONG", command=_SET_MESSAGE_INTERVAL, **params)

    def _flight_mode(self) -> Mode:
        """The one of ours that is nearest; what we do not know shows as it was."""
        heartbeat = self.drone.latest("HEARTBEAT")
        if heartbeat is None:
            return self._mode
        name = {GROUND_ROVER: "rover", FIXED_WING: "plane"}.get(heartbeat.type, DEFAULT_VEHICLE)
        vehicle = next(each.vehicle for each in VEHICLES if each.vehicle.name == name)
        try:
            dialect = self._dialect.of_vehicle(vehicle.modes, vehicle.ardupilot)
            self._mode = dialect.mode_from_custom(heartbeat.custom_mode)
        except UnknownModeError:
            pass
        return self._mode
