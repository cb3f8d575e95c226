"""Which message goes out when: one table of default rates, and each link's own schedule.

In: the vehicle's state, at each frame. Out: frames on one link. Requests change one link's schedule only.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from heapq import heapify, heapreplace

from autopilot.interface.platform import Host
from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.services.identity import autopilot_version
from autopilot.mavlink.telemetry import (
    ardupilot_messages,
    board,
    gimbal_status,
    motion,
    navigation,
    radio,
    sensors,
    sim_state,
    status,
)
from autopilot.mavlink.transport.links import LinkRole
from autopilot.mavlink.wire.adsb_messages import adsb_vehicle
from autopilot.mavlink.wire.codec import MessageType, Payload, known_type
from autopilot.payload.gimbal.gimbal_control import GimbalControl
from common.kernels import FRAME_US, TICK_US

Builder = Callable[[VehicleState], bytes | None]

SPREAD = 8  # streams start at different eighths of their interval, so that no frame has to send them all
NEVER_US = 1 << 62
# What the kernels renew at each tick: these may be sent so often, everything else once per frame.
_RENEWED_EACH_TICK = frozenset(
    {
        *("ATTITUDE", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "ODOMETRY", "HIGHRES_IMU"),
        *("SCALED_IMU", "SCALED_IMU2", "RAW_IMU", "ATTITUDE_TARGET", "ACTUATOR_OUTPUT_STATUS"),
    }
)


@dataclass(frozen=True, slots=True)
class Stream:
    """One message and how often it is sent unasked; 0: on request only."""

    name: str
    build: Builder
    ground_hz: float
    onboard_hz: float
    ardupilot_hz: float = 0.0  # on every link, in that dialect


STREAMS: tuple[Stream, ...] = (
    Stream("SYS_STATUS", status.sys_status, 2, 2),
    Stream("BATTERY_STATUS", status.battery_status, 1, 1),
    Stream("HOME_POSITION", status.home_position, 0.5, 0.5),
    Stream("GPS_GLOBAL_ORIGIN", status.gps_global_origin, 0.2, 0.2),
    Stream("EXTENDED_SYS_STATE", status.extended_sys_state, 5, 5),
    Stream("MISSION_CURRENT", status.mission_current, 1, 1),
    Stream("FENCE_STATUS", status.fence_status, 1, 1),
    Stream("ATTITUDE", motion.attitude, 20, 50),
    Stream("ATTITUDE_QUATERNION", motion.attitude_quaternion, 10, 50),
    Stream("GLOBAL_POSITION_INT", motion.global_position_int, 10, 20),
    Stream("LOCAL_POSITION_NED", motion.local_position_ned, 10, 30),
    Stream("VFR_HUD", motion.vfr_hud, 4, 10),
    Stream("ALTITUDE", motion.altitude, 4, 10),
    Stream("WIND_COV", motion.wind_cov, 1, 2),
    Stream("ODOMETRY", motion.odometry, 0, 0),
    Stream("POSITION_TARGET_LOCAL_NED", motion.position_target_local_ned, 4, 10),
    Stream("POSITION_TARGET_GLOBAL_INT", motion.position_target_global_int, 2, 5),
    Stream("ATTITUDE_TARGET", motion.attitude_target, 4, 10),
    Stream("ORBIT_EXECUTION_STATUS", motion.orbit_execution_status, 2, 2),
    Stream("GPS_RAW_INT", sensors.gps_raw_int, 5, 5),
    Stream("HIGHRES_IMU", sensors.highres_imu, 0, 10),
    Stream("SCALED_IMU", sensors.scaled_imu, 0, 0),
    Stream("RAW_IMU", sensors.raw_imu, 0, 0, 2),
    Stream("SCALED_IMU2", sensors.scaled_imu2, 0, 0, 2),
    Stream("OBSTACLE_DISTANCE", sensors.obstacle_distance, 5, 5),
    Stream("ADSB_VEHICLE", adsb_vehicle, 0, 0),
    Stream("SCALED_PRESSURE", sensors.scaled_pressure, 1, 1),
    Stream("DISTANCE_SENSOR", sensors.distance_sensor, 4, 10),
    Stream("SERVO_OUTPUT_RAW", sensors.servo_output_raw, 2, 2),
    Stream("ACTUATOR_OUTPUT_STATUS", sensors.actuator_output_status, 0, 0),
    Stream("RC_CHANNELS", radio.rc_channels, 1, 1),
    Stream("RC_CHANNELS_RAW", radio.rc_channels_raw, 0, 0),
    Stream("MANUAL_CONTROL", radio.manual_control, 0, 0),
    Stream("VIBRATION", sensors.vibration, 1, 1),
    Stream("ESTIMATOR_STATUS", sensors.estimator_status, 1, 2),
    Stream("AVAILABLE_MODES_MONITOR", status.available_modes_monitor, 0.2, 0.2),
    Stream("FLIGHT_INFORMATION", status.flight_information, 0, 0),
    Stream("NAV_CONTROLLER_OUTPUT", navigation.nav_controller_output, 2, 2),
    Stream("EKF_STATUS_REPORT", ardupilot_messages.ekf_status_report, 0, 0, 1),
    Stream("WIND", ardupilot_messages.wind, 0, 0, 1),
    Stream("RANGEFINDER", ardupilot_messages.rangefinder, 0, 0, 2),
    Stream("TERRAIN_REPORT", ardupilot_messages.terrain_report, 0, 0, 1),
    Stream("AHRS", ardupilot_messages.ahrs, 0, 0, 1),
    Stream("AHRS2", ardupilot_messages.ahrs2, 0, 0, 2),
    Stream("POWER_STATUS", board.power_status, 0, 0, 1),
    Stream("MEMINFO", board.meminfo, 0, 0, 1),
    Stream("HWSTATUS", board.hwstatus, 0, 0, 1),
    Stream("MCU_STATUS", board.mcu_status, 0, 0, 1),
    Stream("ESC_TELEMETRY_1_TO_4", board.esc_telemetry_1_to_4, 0, 0, 1),
    Stream("ESC_TELEMETRY_5_TO_8", board.esc_telemetry_5_to_8, 0, 0, 1),
)


def host_streams(host: Host) -> tuple[Stream, ...]:
    """What the machine around the flight controller knows: the date, and the simulator's truth."""
    return (
        Stream("SYSTEM_TIME", partial(status.system_time, host), 1, 1),
        Stream("HIL_STATE_QUATERNION", partial(sim_state.hil_state_quaternion, host), 0, 0),
        Stream("SIMSTATE", partial(sim_state.simstate, host), 0, 0, 1),
        Stream("SIM_STATE", partial(sim_state.sim_state, host), 0, 0),
    )


# REQUEST_DATA_STREAM: old requests name a group of messages (MAV_DATA_STREAM).
GROUPS: dict[int, tuple[str, ...]] = {
    1: ("HIGHRES_IMU", "SCALED_IMU", "SCALED_PRESSURE"),  # RAW_SENSORS
    2: (
        "SYS_STATUS",
        "GPS_RAW_INT",
        "MISSION_CURRENT",
        "EXTENDED_SYS_STATE",
        "FENCE_STATUS",
        "NAV_CONTROLLER_OUTPUT",
    ),  # EXTENDED_STATUS
    3: ("SERVO_OUTPUT_RAW", "RC_CHANNELS"),  # RC_CHANNELS
    4: ("ATTITUDE_TARGET",),  # RAW_CONTROLLER
    6: ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),  # POSITION
    10: ("ATTITUDE", "ATTITUDE_QUATERNION"),  # EXTRA1
    11: ("VFR_HUD", "ALTITUDE"),  # EXTRA2
    12: (
        *("BATTERY_STATUS", "VIBRATION", "ESTIMATOR_STATUS", "DISTANCE_SENSOR", "WIND_COV"),
        *("EKF_STATUS_REPORT", "WIND", "RANGEFINDER", "SYSTEM_TIME"),
    ),  # EXTRA3
}
# What ArduPilot sends besides in these groups, and of the first group instead: it has no other messages of the IMU.
ARDUPILOT_GROUPS: dict[int, tuple[str, ...]] = GROUPS | {
    1: ("RAW_IMU", "SCALED_IMU2", "SCALED_PRESSURE"),
    2: (*GROUPS[2], "POWER_STATUS", "MCU_STATUS", "MEMINFO"),
    10: (*GROUPS[10], "SIMSTATE", "AHRS2"),
    12: (*GROUPS[12], "AHRS", "HWSTATUS", "TERRAIN_REPORT", "ESC_TELEMETRY_1_TO_4", "ESC_TELEMETRY_5_TO_8"),
}
GROUP_ALL = 0


class Telemetry:
    """Every message the vehicle can be asked for, by id."""

    def __init__(self, dialect: Dialect, sysid: int, host: Host, gimbal: GimbalControl | None = None) -> None:
        def heartbeat(state: VehicleState) -> bytes:
            """Mode, armed or not, state; also at once when one of them changes."""
            return status.heartbeat(state, dialect)

        def version(_: VehicleState) -> bytes:
            """Capabilities, versions, identity."""
            return autopilot_version(dialect, sysid)

        def mission_current(state: VehicleState) -> bytes:
            """The current mission item, of how many (home not counted), and the mission's state."""
            first_seq = dialect.first_seq if state.mission_count else 0
            return status.mission_progress(state, state.mission_current + first_seq)

        def current_mode(state: VehicleState) -> bytes:
            """The mode that is flown, and its standard number."""
            return status.current_mode(state, dialect)

        is_ardupilot = dialect.name == "ardupilot"
        self.groups = ARDUPILOT_GROUPS if is_ardupilot else GROUPS

        streams: tuple[Stream, ...] = (
            Stream("HEARTBEAT", heartbeat, 1, 1),
            *STREAMS,
            *host_streams(host),
            Stream("AUTOPILOT_VERSION", version, 0, 0),
            Stream("CURRENT_MODE", current_mode, 0.5, 0.5),
        )
        if gimbal is not None:
            streams += (
                Stream("GIMBAL_MANAGER_INFORMATION", gimbal_status.gimbal_manager_information, 0, 0),
                Stream("GIMBAL_MANAGER_STATUS", partial(gimbal_status.gimbal_manager_status, gimbal, sysid), 0, 0),
                Stream("MOUNT_ORIENTATION", partial(gimbal_status.mount_orientation, gimbal), 0, 0),
            )
        self.streams = tuple(
            replace(stream, build=mission_current) if stream.name == "MISSION_CURRENT" else stream for stream in streams
        )
        self.types: dict[int, MessageType] = {}
        self.builders: dict[int, Builder] = {}
        self.default_interval_us: dict[LinkRole, dict[int, int]] = {role: {} for role in LinkRole}
        self._own_interval_us: dict[LinkRole, dict[int, int]] = {}  # unless parameters say otherwise
        for stream in self.streams:
            kind = known_type(stream.name)
            self.types[kind.msg_id] = kind
            self.builders[kind.msg_id] = stream.build
            own_hz = stream.ardupilot_hz if is_ardupilot else 0.0
            self.default_interval_us[LinkRole.GROUND][kind.msg_id] = _interval_us(max(stream.ground_hz, own_hz))
            self.default_interval_us[LinkRole.ONBOARD][kind.msg_id] = _interval_us(max(stream.onboard_hz, own_hz))
        self._own_interval_us = {role: dict(intervals) for role, intervals in self.default_interval_us.items()}

    def group_ids(self, group: int) -> list[int]:
        """The messages of a MAV_DATA_STREAM group; GROUP_ALL: those of every group."""
        names = self.groups.values() if group == GROUP_ALL else (self.groups.get(group, ()),)
        return [known_type(name).msg_id for of_group in names for name in of_group]

    def least_interval_us(self, msg_id: int) -> int:
        """How often a message can be sent."""
        return TICK_US if self.types[msg_id].name in _RENEWED_EACH_TICK else FRAME_US

    def set_group_default(self, group: int, rate_hz: float) -> None:
        """Links that come from now on get a group at this rate; negative: each message at its own."""
        for role, intervals in self.default_interval_us.items():
            for msg_id in self.group_ids(group):
                intervals[msg_id] = self._own_interval_us[role][msg_id] if rate_hz < 0.0 else _interval_us(rate_hz)


def _interval_us(rate_hz: float) -> int:
    """0 for a rate of 0: not sent."""
    return max(round(1.0e6 / rate_hz), FRAME_US) if rate_hz > 0.0 else 0


class StreamSchedule:
    """When each message is due on one link."""

    def __init__(self, telemetry: Telemetry, role: LinkRole) -> None:
        self._telemetry = telemetry
        self._role = role
        self._defaults = dict(telemetry.default_interval_us[role])
        self.interval_us = dict(self._defaults)  # by message id; 0: not sent
        self._queue: list[tuple[int, int]] = []  # (due time, message id), a heap
        self._is_planned = False
        self.needs_ticks = False  # a message is sent more often than once per frame

    def refusal(self, msg_id: int, interval_us: int) -> str:
        """Why a message cannot be sent at an interval; empty if it can."""
        least_us = self._telemetry.least_interval_us(msg_id)
        return f"at most {1_000_000 // least_us} Hz" if 0 < interval_us < least_us else ""

    def set_interval(self, msg_id: int, interval_us: int) -> None:
        """Sends a message every `interval_us`, at most as often as it can be; 0: default interval; negative: never."""
        if interval_us == 0:
            self._change(msg_id, self._defaults[msg_id])
        else:
            least_us = self._telemetry.least_interval_us(msg_id)
            self._change(msg_id, max(interval_us, least_us) if interval_us > 0 else 0)

    def set_default(self, msg_id: int, interval_us: int) -> None:
        """Makes an interval the default on this link, and sends the message so."""
        self._defaults[msg_id] = interval_us
        self.set_interval(msg_id, 0)

    def set_group(self, group: int, rate_hz: float) -> None:
        """Sets the rate of every message of a MAV_DATA_STREAM group; 0 stops them."""
        for msg_id in self._telemetry.group_ids(group):
            self._change(msg_id, _interval_us(rate_hz))

    def reset_group(self, group: int) -> None:
        """Sends every message of a group as a link that comes now would get it."""
        defaults = self._telemetry.default_interval_us[self._role]
        for msg_id in self._telemetry.group_ids(group):
            self._defaults[msg_id] = defaults[msg_id]
            self._change(msg_id, defaults[msg_id])

    def postpone(self, msg_id: int, due_us: int) -> None:
        """Sends a streamed message next at a time, because it has just been sent otherwise."""
        if self._is_planned:
            self._queue = [(due_us if each == msg_id else when_us, each) for when_us, each in self._queue]
            heapify(self._queue)

    def _change(self, msg_id: int, interval_us: int) -> None:
        """The other streams keep their times: clients repeat their requests often."""
        if interval_us == self.interval_us[msg_id]:
            return
        self.interval_us[msg_id] = interval_us
        self.needs_ticks = any(0 < each < FRAME_US for each in self.interval_us.values())
        if self._is_planned:
            self._queue = [entry for entry in self._queue if entry[1] != msg_id]
            if interval_us:
                self._queue.append((0, msg_id))
            heapify(self._queue)

    def _plan(self, now_us: int) -> None:
        """Starts every stream, spread over its interval."""
        active = [(msg_id, interval_us) for msg_id, interval_us in self.interval_us.items() if interval_us]
        self._queue = [
            (now_us + interval_us * (i % SPREAD) // SPREAD, msg_id) for i, (msg_id, interval_us) in enumerate(active)
        ]
        self._queue.append((NEVER_US, -1))
        heapify(self._queue)
        self._is_planned = True

    def due(self, now_us: int, state: VehicleState, built: dict[int, bytes | None]) -> list[Payload]:
        """What is due now; where messages come more often than frames, first what was due since the last one.

        Args:
            now_us: simulated time.
            state: of the vehicle now.
            built: what other links were sent of it now, by message id; added to.
        """
        messages: list[Payload] = []
        if self.needs_ticks:
            for moment in state.ticks:
                self._add_due(moment.time_us, moment, {}, messages)
        self._add_due(now_us, state, built, messages)
        return messages

    def _add_due(
        self, now_us: int, state: VehicleState, built: dict[int, bytes | None], messages: list[Payload]
    ) -> None:
        if not self._is_planned:
            self._plan(now_us)
        queue = self._queue
        builders, types, interval_us = self._telemetry.builders, self._telemetry.types, self.interval_us
        while queue[0][0] <= now_us:
            due_us, msg_id = queue[0]
            next_us = due_us + interval_us[msg_id]
            heapreplace(queue, (next_us if next_us > now_us else now_us + interval_us[msg_id], msg_id))
            if msg_id not in built:
                built[msg_id] = builders[msg_id](state)
            payload = built[msg_id]
            if payload is not None:
                messages.append((types[msg_id], payload))
