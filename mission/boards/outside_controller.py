"""An outside autopilot in the place of our flight controller, as far as it tells: for logs, pages and summaries.

In: its telemetry, as the flight's own client hears it. Out: a `VehicleState`, and its estimate and actuator commands in
the rig's rows of our own controller, from where recorders and pages read them. Nothing here flies.
"""

from collections.abc import Sequence
from math import nan
from typing import Any

import numpy as np

from autopilot.interface.aircraft import Aircraft
from autopilot.interface.vehicle_state import LandedState, Mode, Severity, VehicleState
from autopilot.mavlink.dialects import Dialect, UnknownModeError
from autopilot.mavlink.wire.adsb_messages import fields_of
from autopilot.mavlink.wire.codec import message_id
from autopilot.mavlink.wire.convert import UINT16_MAX, degrees_from_e7
from autopilot.vehicles.vehicle_class import VehicleClass
from common.airframe import Airframe
from common.attitude import quat_of_roll_pitch_yaw
from common.geodesy import GeoPoint, ned_from_geodetic
from common.params import ParameterTable
from mission.console.status_texts import Texts
from mission.script import Drone
from mission.simulator.host_ports import host_ports
from sim.stepped import SteppedRig

RATES_HZ = {
    "ATTITUDE": 20.0,
    "GLOBAL_POSITION_INT": 20.0,
    "LOCAL_POSITION_NED": 20.0,
    "SYS_STATUS": 2.0,
    "EXTENDED_SYS_STATE": 5.0,
    "HOME_POSITION": 1.0,
    "MISSION_CURRENT": 2.0,
}
"""What is asked for, and how often [Hz]."""
NEEDED_HZ = 2.0  # of what else the client needs
ASK_AGAIN_US = 5_000_000  # what has not come for so long
_SET_MESSAGE_INTERVAL = 511
_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_UNKNOWN_PERCENT = -1
_CENTI, _MILLI = 1e-2, 1e-3


class OutsideController:
    """What is known of it.

    Args:
        rig: the simulation, of one vehicle.
        vehicle: its class.
        airframe: of the vehicle.
        drone: the flight's client, whose newest messages are read.
        dialect: whose numbers it speaks.
        home: origin of ned.
        texts: gets its texts.
    """

    def __init__(
        self,
        rig: SteppedRig,
        vehicle: VehicleClass,
        airframe: Airframe,
        drone: Drone,
        dialect: Dialect,
        home: GeoPoint,
        texts: Texts,
    ) -> None:
        self.modes = vehicle.modes
        self.params = ParameterTable([])
        """None of its parameters are ours to log."""
        self.camera = None
        outputs = vehicle.outputs(airframe)
        self.state = VehicleState(origin=home, outputs=outputs, motor_count=len(vehicle.motors(airframe)))
        self._drone, self._home, self._texts = drone, home, texts
        self._dialect = dialect.of_vehicle(vehicle.modes, vehicle.ardupilot)
        self._ports = host_ports(rig)
        self._estimate = rig.rows["autopilot.ekf.rows"][0]["estimate"]
        self._command = rig.rows["autopilot.control"][0]["actuators"]["command"]
        self._commands = rig.board_commands.numpy()[0]  # live, as those above
        self._text_count = 0
        self._heard: dict[str, tuple[Any, int]] = {}  # the newest of each message, and when it came
        self.frame(0)

    @property
    def commander(self) -> "OutsideController":
        return self

    @property
    def traffic(self) -> "OutsideController":
        return self

    def report(self, aircraft: Aircraft) -> None:
        """A receiver on board has heard another aircraft."""
        self._drone.send("ADSB_VEHICLE", **fields_of(aircraft))

    def check_arming(self) -> Sequence[str]:
        """Why it cannot be armed; it says so itself when it is asked to."""
        return () if self.state.is_ready_to_arm else ("the autopilot does not say that it is ready",)

    def frame(self, time_us: int) -> None:
        """Takes in what has been heard."""
        state = self.state
        state.time_us = time_us
        self._ask(time_us)
        self._read_motion()
        self._command[:] = self._commands
        state.estimate = self._ports.read_estimate()
        state.samples = self._ports.read_samples()
        state.actuators = self._ports.read_actuators()
        if state.health is None:
            state.health = self._ports.read_health()
        self._read_state(time_us)
        for text in self._drone.texts[self._text_count :]:
            self._texts.statustext(Severity.INFO, text.rstrip())
        self._text_count = len(self._drone.texts)

    def _ask(self, time_us: int) -> None:
        """For what has not come for a while; before its first heartbeat for nothing."""
        if self._drone.latest("HEARTBEAT") is None:
            return
        for name, rate_hz in {**RATES_HZ, **dict.fromkeys(self._drone.needs, NEEDED_HZ)}.items():
            newest = self._drone.latest(name)
            before, since_us = self._heard.get(name, (None, time_us - ASK_AGAIN_US))
            if newest is not before:
                self._heard[name] = (newest, time_us)
            elif time_us - since_us >= ASK_AGAIN_US:
                self._heard[name] = (newest, time_us)
                params = {"param1": float(message_id(name)), "param2": 1e6 / rate_hz}
                self._drone.ask("COMMAND_LONG", command=_SET_MESSAGE_INTERVAL, **params)

    def _read_motion(self) -> None:
        """Its estimate, on the ned axes at home."""
        estimate = self._estimate
        attitude, place = self._drone.latest("ATTITUDE"), self._drone.latest("GLOBAL_POSITION_INT")
        if attitude is not None:
            estimate["q_ned_from_frd"] = quat_of_roll_pitch_yaw(attitude.roll, attitude.pitch, attitude.yaw)
            estimate["omega_frd"] = (attitude.rollspeed, attitude.pitchspeed, attitude.yawspeed)
            self.state.roll_rad, self.state.pitch_rad, self.state.yaw_rad = attitude.roll, attitude.pitch, attitude.yaw
        elif not np.any(estimate["q_ned_from_frd"]):
            estimate["q_ned_from_frd"][3] = 1.0
        if place is not None and (place.lat or place.lon):  # 0, 0: it has no place yet
            lat_deg, lon_deg = degrees_from_e7(place.lat), degrees_from_e7(place.lon)
            estimate["pos_ned"] = ned_from_geodetic(lat_deg, lon_deg, _MILLI * place.alt, self._home)
            estimate["vel_ned"] = (_CENTI * place.vx, _CENTI * place.vy, _CENTI * place.vz)
        estimate["time_us"] = self.state.time_us

    def _read_state(self, time_us: int) -> None:
        state, drone = self.state, self._drone
        if drone.lost:
            state.is_armed = state.is_ready_to_arm = False
            return
        heartbeat, status, mission = (drone.latest(name) for name in ("HEARTBEAT", "SYS_STATUS", "MISSION_CURRENT"))
        if heartbeat is not None:
            is_armed = bool(heartbeat.base_mode & _ARMED)
            if is_armed and not state.is_armed:
                state.armed_since_us = time_us
            state.is_armed, state.mav_type = is_armed, heartbeat.type
            state.mode = self._mode(heartbeat.custom_mode)
        state.is_ready_to_arm = drone.is_ready
        state.battery_remaining = nan
        if status is not None and status.battery_remaining != _UNKNOWN_PERCENT:
            state.battery_remaining = _CENTI * status.battery_remaining
        landed = drone.latest("EXTENDED_SYS_STATE")
        if landed is not None:
            state.landed_state = LandedState(landed.landed_state or LandedState.ON_GROUND)
        if mission is not None:
            state.mission_current = max(mission.seq - self._dialect.first_seq, 0)
            state.mission_count = 0 if mission.total == UINT16_MAX else mission.total
            state.mission_state = mission.mission_state

    def _mode(self, custom_mode: int) -> Mode:
        """The one of ours that is nearest; what we do not know shows as it was."""
        try:
            return self._dialect.mode_from_custom(custom_mode)
        except UnknownModeError:
            return self.state.mode

    def attach(self, announcer: Any) -> None:
        """Who wants to hear what happens reads it each frame."""
