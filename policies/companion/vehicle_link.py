"""The companion's MAVLink link: what the vehicle and the owner's phone tell, and what the companion says to them.

In: bytes of a link. Out: the newest telemetry with the time of its arrival; heartbeats, requests for telemetry rates,
setpoints, mode changes and texts. The companion is a component of the vehicle's own system, as onboard computers are.
Any autopilot with PX4's or ArduPilot's modes will do.
"""

from collections.abc import Callable
from math import isfinite, isnan, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.interface.vehicle_state import BatteryLevel, LandedState, Mode, Severity
from autopilot.mavlink.client_end import AUTOPILOT_COMPONENT, ByteLink, ClientEnd, frame_of
from autopilot.mavlink.dialects import Dialect, UnknownModeError
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.wire.codec import decode, message_id
from autopilot.mavlink.wire.convert import degrees_from_e7, quat_from_wxyz
from autopilot.mavlink.wire.number_bounds import POSITION_MAX_M, RATE_MAX_RAD_S, SPEED_MAX_M_S, is_known
from autopilot.vehicles.rover.vehicle import ROVER
from common.attitude import Vector
from common.geodesy import GeoPoint, ned_from_geodetic
from policies.companion.engagement import Wish
from policies.companion.odometry.steady_frame import SteadyFrame
from policies.companion.telemetry import NEVER_US, RANGE_OLD_US, Own, Owner
from policies.companion.vehicle_clock import VehicleClock

Floats = NDArray[np.float64]
Listener = Callable[[int, int, Any, int], None]
"""Called with who sent a message (system, component), its fields, and when it came in [us]."""

COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
OVERTAKEN_US = 1_000_000  # an attitude older by no more has been overtaken; by more, the vehicle has restarted; guess
REQUEST_US = 5_000_000  # rates are asked for again: the vehicle may have restarted
TEXT_LENGTH = 50  # characters of one STATUSTEXT

# What is asked for, and how often [Hz]: in training nothing that is seen is older than a frame of 20 ms
RATES_HZ = {
    "ATTITUDE_QUATERNION": 50.0,
    "LOCAL_POSITION_NED": 50.0,
    "DISTANCE_SENSOR": 50.0,
    "EXTENDED_SYS_STATE": 5.0,
    "GPS_GLOBAL_ORIGIN": 1.0,
    "SYS_STATUS": 5.0,
    "BATTERY_STATUS": 1.0,
}
_COMMAND_SET_MODE, _COMMAND_SET_INTERVAL = 176, 511
_CUSTOM_MODE = 1.0  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_GROUND_VEHICLES = (10, 11)  # MAV_TYPE: rover, boat
_FAILSAFE = (5, 6)  # MAV_STATE: critical, emergency
_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_LOCAL_NED, _BODY_NED = 1, 8  # MAV_FRAME
_VIO = 3  # MAV_ESTIMATOR_TYPE
_UPPER = (0, 1, 2, 6, 7, 11)  # of a symmetric 6 x 6 matrix in MAVLink's order, its first 3 x 3
_VELOCITY_AND_YAW_RATE = 0b0101_1100_0111  # type_mask: position, acceleration and yaw are free
_VELOCITY = 0b1101_1100_0111  # the yaw rate, too
_HAS_POSITION, _HAS_VELOCITY = 1, 2  # FOLLOW_TARGET.est_capabilities
_LOOKS_DOWN = 25  # MAV_SENSOR_ROTATION_PITCH_270
_IDS = {
    name: message_id(name)
    for name in (*RATES_HZ, "HEARTBEAT", "FOLLOW_TARGET", "COMMAND_ACK", "STATUSTEXT")
}  # fmt: skip
_STATUS = frozenset({"EXTENDED_SYS_STATE", "SYS_STATUS", "BATTERY_STATUS", "STATUSTEXT"})
_NAMES = {msg_id: name for name, msg_id in _IDS.items()}
_DIALECTS: dict[int, Dialect] = {int(PX4.autopilot): PX4, int(ARDUPILOT.autopilot): ARDUPILOT}
_GROUND_DIALECTS: dict[int, Dialect] = {
    number: dialect.of_vehicle(ROVER.modes, ROVER.ardupilot) for number, dialect in _DIALECTS.items()
}


class VehicleLink:
    """The companion's end of a link.

    Args:
        link: bytes to and from the vehicle.
        system_id: of the vehicle.
        is_by_sticks: it is not flown in Offboard or Guided, but driven in mode Position.
    """

    def __init__(self, link: ByteLink, *, system_id: int = 1, is_by_sticks: bool = False) -> None:
        self.is_by_sticks = is_by_sticks
        self.own = Own()
        self.clock = VehicleClock()
        self.frame = SteadyFrame()
        """In which places are kept; the vehicle's own unless somebody watches its corrections."""
        self.owner = Owner()
        self.system_id = system_id
        self._client = ClientEnd(link, system_id, COMPONENT, vehicle_id=system_id)
        self._dialect: Dialect = PX4
        self._listeners: dict[int, Listener] = {}
        self._rates_hz = {**RATES_HZ}
        self._text_id = 0
        self._low_batteries: set[int] = set()  # their ids
        self._is_refused = False
        self._asked_for: Mode | None = None  # and not answered yet
        self._request_us = NEVER_US
        self.other_us = NEVER_US
        """When another companion was heard last, by our own address on its heartbeat."""

    def receive(self, time_us: int) -> None:
        """Takes in what has arrived."""
        for msg_id, sysid, compid, frame in self._client.arrived():
            name = _NAMES.get(msg_id)
            listener = self._listeners.get(msg_id)
            if listener is not None:
                listener(sysid, compid, decode(frame_of(frame)).fields, time_us)
            if name == "HEARTBEAT" and (sysid, compid) == (self.system_id, COMPONENT):
                self.other_us = time_us
            if name == "FOLLOW_TARGET":
                self._owner_reported(decode(frame_of(frame)).fields, time_us)
            elif name is not None and sysid == self.system_id and compid == AUTOPILOT_COMPONENT:
                self._vehicle_reported(name, decode(frame_of(frame)).fields, time_us)
        own = self.own
        own.late_s = (time_us - min(own.attitude_us, own.position_us)) * 1e-6
        if time_us - own.range_us >= RANGE_OLD_US:
            own.range_m = nan

    def listen(self, name: str, listener: Listener, rate_hz: float = 0.0) -> None:
        """Has a listener called with messages of one kind, whoever sent them.

        Args:
            name: of the message.
            listener: the only one of this kind.
            rate_hz: what the vehicle is asked for; 0: nothing.
        """
        self._listeners[message_id(name)] = listener
        if rate_hz > 0.0:
            self._rates_hz[name] = max(rate_hz, self._rates_hz.get(name, 0.0))

    def keep_alive(self, time_us: int) -> None:
        """Sends the heartbeat, and asks for telemetry, when they are due."""
        self._client.keep_alive(time_us)
        if self.own.heartbeat_us != NEVER_US and time_us - self._request_us >= REQUEST_US:
            self._request_us = time_us
            for name, rate_hz in self._rates_hz.items():
                self._client.command(_COMMAND_SET_INTERVAL, float(message_id(name)), 1.0e6 / rate_hz)

    def take_refusal(self) -> bool:
        """Whether the vehicle has refused a change of mode since the last call."""
        is_refused, self._is_refused = self._is_refused, False
        return is_refused

    @property
    def is_ardupilot(self) -> bool:
        return int(self._dialect.autopilot) == int(ARDUPILOT.autopilot)

    @property
    def is_flown(self) -> bool:
        """Whether it is in a mode that follows what is sent."""
        ours = (Mode.POSITION,) if self.is_by_sticks else (Mode.OFFBOARD, Mode.GUIDED)
        return self.own.mode in ours

    @property
    def _flown_mode(self) -> Mode:
        """The mode in which it follows what is sent."""
        if self.is_by_sticks:
            return Mode.POSITION
        return Mode.GUIDED if self.is_ardupilot and Mode.GUIDED in self._dialect.mode_table else Mode.OFFBOARD

    @property
    def _hold_mode(self) -> Mode:
        """Where it waits: an ArduPilot that flies sinks in Loiter, unless somebody holds its throttle stick."""
        return Mode.BRAKE if self.is_ardupilot and Mode.BRAKE in self._dialect.mode_table else Mode.HOLD

    def send(self, name: str, **fields: Any) -> None:
        """A message to everybody, or to whom its fields name."""
        self._client.send(name, **fields)

    def ask(self, name: str, **fields: Any) -> None:
        """A message to the autopilot."""
        self._client.ask(name, **fields)

    def send_setpoint(self, velocity: Vector, yaw_rate: float, *, is_along_nose: bool = False) -> None:
        """A velocity [m/s] and a yaw rate [rad/s], flown in Offboard.

        Args:
            velocity: in ned, or ahead, right and down.
            yaw_rate: clockwise from above; NaN: none.
            is_along_nose: it is ahead, right and down.
        """
        x, y, z = velocity
        self._client.ask(
            "SET_POSITION_TARGET_LOCAL_NED",
            time_boot_ms=max(self.own.boot_us, 0) // 1000 & 0xFFFFFFFF,
            coordinate_frame=_BODY_NED if is_along_nose else _LOCAL_NED,
            type_mask=_VELOCITY_AND_YAW_RATE if isfinite(yaw_rate) else _VELOCITY,
            vx=x,
            vy=y,
            vz=z,
            yaw_rate=yaw_rate if isfinite(yaw_rate) else 0.0,
        )

    def send_velocity(self, time_us: int, vel_ned: Floats, cov: Floats) -> None:
        """A velocity for the vehicle's estimator: ODOMETRY without a pose, the only message with one that PX4 takes.

        To ArduPilot it is VISION_SPEED_ESTIMATE.

        Args:
            time_us: on the vehicle's clock.
            vel_ned: [m/s] (3,)
            cov: [m²/s²] (3, 3)
        """
        north, east, down = (float(x) for x in vel_ned)
        if self.is_ardupilot:
            covariance = tuple(float(x) for x in cov.ravel())
            self.send("VISION_SPEED_ESTIMATE", usec=time_us, x=north, y=east, z=down, covariance=covariance)
            return
        upper = np.full(21, nan)
        upper[list(_UPPER)] = cov[np.triu_indices(3)]
        pose = {"x": nan, "y": nan, "z": nan, "q": (nan,) * 4, "pose_covariance": (nan,) * 21}
        self.send(
            "ODOMETRY",
            **pose,
            time_usec=time_us,
            frame_id=_LOCAL_NED,
            child_frame_id=_LOCAL_NED,
            vx=north,
            vy=east,
            vz=down,
            rollspeed=nan,
            pitchspeed=nan,
            yawspeed=nan,
            velocity_covariance=tuple(float(x) for x in upper),
            estimator_type=_VIO,
        )

    def ask_for(self, wish: Wish) -> None:
        """Asks the vehicle for a mode."""
        is_px4 = not self.is_ardupilot
        modes = {Wish.HOLD: self._hold_mode, Wish.RETURN: Mode.RETURN}
        mode = modes.get(wish, self._flown_mode)
        self._asked_for = mode
        number = self._dialect.custom_mode(mode)
        if is_px4:
            self._client.command(_COMMAND_SET_MODE, _CUSTOM_MODE, number >> 16 & 0xFF, number >> 24 & 0xFF)
        else:
            self._client.command(_COMMAND_SET_MODE, _CUSTOM_MODE, number)

    def say(self, text: str, severity: Severity = Severity.NOTICE) -> None:
        """A text for the pilot's ground station."""
        pieces = [text[start : start + TEXT_LENGTH] for start in range(0, len(text), TEXT_LENGTH)]
        text_id = 0
        if len(pieces) > 1:
            self._text_id = text_id = self._text_id % 0xFFFF + 1
        for i, piece in enumerate(pieces):
            self._client.send("STATUSTEXT", severity=int(severity), text=piece, id=text_id, chunk_seq=i)

    def close(self) -> None:
        self._client.link.close()

    def _vehicle_reported(self, name: str, fields: Any, time_us: int) -> None:
        own = self.own
        if name == "ATTITUDE_QUATERNION":
            self._attitude_reported(fields, time_us)
        elif name == "LOCAL_POSITION_NED":
            pos_ned, vel_ned = (fields.x, fields.y, fields.z), (fields.vx, fields.vy, fields.vz)
            if is_known(POSITION_MAX_M, *pos_ned) and is_known(SPEED_MAX_M_S, *vel_ned):
                boot_us = self.clock.time_us(fields.time_boot_ms)
                own.pos_ned, own.vel_ned = self.frame.steady(boot_us, pos_ned, vel_ned), vel_ned
                own.position_us = time_us
        elif name == "DISTANCE_SENSOR":
            self._distance_reported(fields, time_us)
        elif name == "HEARTBEAT":
            self._heartbeat_reported(fields, time_us)
        elif name in _STATUS:
            self._status_reported(name, fields, time_us)
        elif name == "GPS_GLOBAL_ORIGIN":
            own.origin = GeoPoint(
                degrees_from_e7(fields.latitude), degrees_from_e7(fields.longitude), fields.altitude * 1.0e-3
            )
        elif self._client.is_answer(fields, _COMMAND_SET_MODE):  # COMMAND_ACK
            self._is_refused |= fields.result != 0
            if fields.target_component == COMPONENT:  # one to everybody may answer a ground station
                if fields.result == 0 and self._asked_for is not None:
                    self._enter(self._asked_for)  # known now: its next heartbeat may be a second away
                self._asked_for = None

    def _attitude_reported(self, fields: Any, time_us: int) -> None:
        wxyz = (fields.q1, fields.q2, fields.q3, fields.q4)
        omega_frd = (fields.rollspeed, fields.pitchspeed, fields.yawspeed)
        if is_known(1.1, *wxyz) and is_known(RATE_MAX_RAD_S, *omega_frd):  # of unit length, but for rounding
            own, boot_us = self.own, self.clock.time_us(fields.time_boot_ms)
            if 0 < own.boot_us - boot_us <= OVERTAKEN_US:
                return  # overtaken by a newer one
            own.q_ned_from_frd, own.omega_frd = quat_from_wxyz(wxyz), omega_frd
            own.boot_us, own.attitude_us = boot_us, time_us

    def _status_reported(self, name: str, fields: Any, time_us: int) -> None:
        own = self.own
        if name == "EXTENDED_SYS_STATE":
            own.is_on_ground = fields.landed_state != LandedState.IN_AIR
            own.is_landing = fields.landed_state == LandedState.LANDING
        elif name == "SYS_STATUS":
            own.health = fields.onboard_control_sensors_health
        elif name == "BATTERY_STATUS":
            is_low = fields.charge_state > BatteryLevel.OK
            (self._low_batteries.add if is_low else self._low_batteries.discard)(fields.id)
            own.is_battery_low = bool(self._low_batteries)
        elif fields.severity <= Severity.ALERT:
            own.alarm_us = time_us

    def _distance_reported(self, fields: Any, time_us: int) -> None:
        if fields.orientation != _LOOKS_DOWN:
            return
        is_inside = fields.min_distance <= fields.current_distance <= fields.max_distance
        own = self.own
        own.range_m = fields.current_distance * 0.01 if is_inside else nan
        own.range_us = time_us
        if is_inside:
            own.ground_down_m, own.ground_us = own.pos_ned[2] + own.height_m, time_us

    def _heartbeat_reported(self, fields: Any, time_us: int) -> None:
        own = self.own
        own.heartbeat_us = time_us
        own.is_ground_vehicle = fields.type in _GROUND_VEHICLES
        dialects = _GROUND_DIALECTS if own.is_ground_vehicle else _DIALECTS
        self._dialect = dialects.get(fields.autopilot, dialects[int(PX4.autopilot)])
        own.is_armed = bool(fields.base_mode & _ARMED)
        own.is_failsafe = fields.system_status in _FAILSAFE
        try:
            self._enter(self._dialect.mode_from_custom(fields.custom_mode))
        except UnknownModeError:
            own.mode, own.mode_name = None, f"{fields.custom_mode:#x}"

    def _enter(self, mode: Mode) -> None:
        self.own.mode, self.own.mode_name = mode, mode.name.replace("_", " ").capitalize()

    def _owner_reported(self, fields: Any, time_us: int) -> None:
        origin = self.own.origin
        if origin is None or not fields.est_capabilities & _HAS_POSITION:
            return
        pos_ned = ned_from_geodetic(degrees_from_e7(fields.lat), degrees_from_e7(fields.lon), fields.alt, origin)
        has_velocity = bool(fields.est_capabilities & _HAS_VELOCITY) and not any(map(isnan, fields.vel))
        north, east, down = fields.vel if has_velocity else (0.0, 0.0, 0.0)
        if not is_known(POSITION_MAX_M, *pos_ned) or not is_known(SPEED_MAX_M_S, north, east, down):
            return
        owner, var = self.owner, fields.position_cov[0]
        owner.pos_ned, owner.vel_ned, owner.has_velocity = self.frame.of(pos_ned), (north, east, down), has_velocity
        owner.std_m = var**0.5 if 0.0 < var <= POSITION_MAX_M else nan
        owner.arrived_us = time_us
        owner.count += 1
