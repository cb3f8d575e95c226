"""The gimbal over MAVLink: the manager's commands and messages, and the device as a component of its own (id 154).

Clients find the manager by asking for its information; from then on their link gets its status and the device's
attitude. Nobody else pays for them.
"""

from collections.abc import Mapping
from math import isfinite, nan
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Reply, Severity, Verdict
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.components.component import Component, Payload
from autopilot.mavlink.service import Command, CommandHandler, Handler, Service, denied
from autopilot.mavlink.telemetry.gimbal_status import DEVICE_ABILITIES, manager_flags
from autopilot.mavlink.telemetry.motion import boot_ms
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import quat_from_wxyz, wxyz_from_quat
from autopilot.mavlink.wire.number_bounds import ANGLE_MAX_RAD, RATE_MAX_RAD_S, is_within
from autopilot.payload.gimbal.gimbal import PITCH_MAX, PITCH_MIN, RATE_MAX, YAW_MAX, YAW_MIN
from autopilot.payload.gimbal.gimbal_control import DEVICE_ID, Flag, GimbalControl
from common.attitude import roll_pitch_yaw_of

STATUS_US = 200_000  # the 5 Hz of the protocol
ATTITUDE_US = 100_000
_FIRMWARE = 1

_MANAGER_INFORMATION_ID = known_type("GIMBAL_MANAGER_INFORMATION").msg_id
_MANAGER_STATUS_ID = known_type("GIMBAL_MANAGER_STATUS").msg_id
_DEVICE_INFORMATION = known_type("GIMBAL_DEVICE_INFORMATION")
_ATTITUDE_STATUS = known_type("GIMBAL_DEVICE_ATTITUDE_STATUS")


class GimbalDevice(Component):
    """The gimbal itself: tells its attitude.

    Args:
        endpoint: the vehicle's links.
        control: of the gimbal.
    """

    def __init__(self, endpoint: Endpoint, control: GimbalControl) -> None:
        self._control = control
        super().__init__(endpoint, DEVICE_ID, mavlink.MAV_TYPE_GIMBAL, "Gimbal")

    def payloads(self) -> Mapping[str, Payload]:
        return {
            "GIMBAL_DEVICE_INFORMATION": self._information,
            "GIMBAL_DEVICE_ATTITUDE_STATUS": self._attitude,
        }

    def default_interval_us(self, msg_id: int) -> int:
        return ATTITUDE_US if msg_id == _ATTITUDE_STATUS.msg_id else 0

    def _information(self) -> bytes:
        """Maker, abilities and range."""
        return _DEVICE_INFORMATION.pack(
            time_boot_ms=boot_ms(self.endpoint.time_us),
            vendor_name="Honeyguide",
            model_name="Simulated gimbal",
            custom_name="",
            firmware_version=_FIRMWARE,
            hardware_version=_FIRMWARE,
            cap_flags=DEVICE_ABILITIES,
            pitch_min=PITCH_MIN,
            pitch_max=PITCH_MAX,
            yaw_min=YAW_MIN,
            yaw_max=YAW_MAX,
        )

    def _attitude(self) -> bytes:
        """Attitude of the camera, from north or from the nose as the flags say."""
        gimbal, state = self._control.gimbal, self.endpoint.vehicle.state
        flags = manager_flags(self._control)
        is_from_north = bool(flags & Flag.YAW_IN_EARTH_FRAME)
        q = gimbal.q_ned_from_frd() if is_from_north else gimbal.q_heading_from_frd()
        pitch_rate, yaw_rate = gimbal.omega
        vehicle_yaw_rate = state.estimate.omega_frd[2]
        return _ATTITUDE_STATUS.pack(
            time_boot_ms=boot_ms(state.time_us),
            flags=flags,
            q=wxyz_from_quat(q),
            angular_velocity_x=0.0,
            angular_velocity_y=pitch_rate,
            angular_velocity_z=yaw_rate + (vehicle_yaw_rate if is_from_north else 0.0),
            failure_flags=0,
            delta_yaw=state.yaw_rad,
            delta_yaw_velocity=vehicle_yaw_rate,
        )


class GimbalManager(Service):
    """Lets clients take control of the gimbal and point it; the regions of interest come from the mission commands.

    Args:
        endpoint: the vehicle's links.
        control: of the gimbal.
        device: the gimbal's own component.
    """

    def __init__(self, endpoint: Endpoint, control: GimbalControl, device: GimbalDevice) -> None:
        self._endpoint = endpoint
        self._control = control
        self._device = device
        endpoint.on_request[_MANAGER_INFORMATION_ID] = self._found

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: self._pitchyaw,
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: self._configure,
            mavlink.MAV_CMD_DO_MOUNT_CONTROL: self._mount_control,
            mavlink.MAV_CMD_DO_MOUNT_CONFIGURE: self._mount_configure,
        }

    def messages(self) -> Mapping[str, Handler]:
        return {
            "GIMBAL_MANAGER_SET_ATTITUDE": self.attitude_received,
            "GIMBAL_MANAGER_SET_PITCHYAW": self.pitchyaw_received,
            "GIMBAL_MANAGER_SET_MANUAL_CONTROL": self.manual_received,
        }

    def _found(self, sender: Sender) -> None:
        """A client has found the manager: its link gets status and attitude, unless it has set rates of its own."""
        schedule = sender.channel.schedule
        if schedule.interval_us[_MANAGER_STATUS_ID] == 0:
            schedule.set_default(_MANAGER_STATUS_ID, STATUS_US)
        if self._device.interval_us(sender.channel, _ATTITUDE_STATUS.msg_id) < 0:
            self._device.set_interval(sender.channel, _ATTITUDE_STATUS.msg_id, ATTITUDE_US)

    def _pitchyaw(self, command: Command) -> Reply:
        """Points the gimbal by angles and rates.

        Params: p1 pitch [deg] from the horizon, up is positive; p2 yaw [deg]; p3, p4 their rates [deg/s], used where
        the angle is NaN; p5 GIMBAL_MANAGER_FLAGS: with YAW_LOCK yaw is from north and held, else from the nose; p7
        gimbal (0, 1 or 154). Angles out of range go to its end.
        Refused: DENIED: another client has control, there is no such gimbal, or it is to be retracted.
        """
        return self._run(command)

    def _configure(self, command: Command) -> Reply:
        """Gives, takes or leaves control of the gimbal.

        Params: p1, p2 system and component id of the primary controller; p3, p4 of the secondary; 0 nobody, -1 as it
        is, -2 the sender, -3 the sender no more; p7 gimbal (0, 1 or 154).
        Refused: DENIED: there is no such gimbal, or no such ids.
        """
        return self._run(command)

    def _mount_control(self, command: Command) -> Reply:
        """Points the gimbal (the older form).

        Params: p7 MAV_MOUNT_MODE: 1 neutral; 2 p1 pitch and p3 yaw from the nose [deg]; 4 place p5, p6 at altitude p4;
        6 home.
        Refused: UNSUPPORTED: other modes; DENIED: another client has control, or there is no such place.
        """
        return self._run(command)

    def _mount_configure(self, command: Command) -> Reply:
        """Sets the mount's mode (the older form); it is always stabilised.

        Params: p1 MAV_MOUNT_MODE: 1 neutral, 2 commands.
        Refused: UNSUPPORTED: other modes; DENIED: another client has control.
        """
        return self._run(command)

    def _run(self, command: Command) -> Reply:
        client = (command.sender.sysid, command.sender.compid)
        params = (command.p1, command.p2, command.p3, command.p4)
        return self._control.run_for(client, command.command, params, command.x, command.y, command.z)

    def _point(self, sender: Sender, f: Any, pitch: float, yaw: float, pitch_rate: float, yaw_rate: float) -> None:
        if f.gimbal_device_id not in (0, 1, DEVICE_ID):
            return
        client = (sender.sysid, sender.compid)
        if is_within(ANGLE_MAX_RAD, pitch, yaw) and is_within(RATE_MAX_RAD_S, pitch_rate, yaw_rate):
            reply = self._control.point(client, f.flags, pitch, yaw, pitch_rate, yaw_rate)
        else:
            reply = denied("an angle or a rate is out of range")
        if reply.verdict is not Verdict.ACCEPTED:
            self._endpoint.text_once(Severity.NOTICE, f"Gimbal: {reply.reason}")

    def attitude_received(self, sender: Sender, f: Any) -> None:
        """Points the gimbal by a quaternion, or turns it at rates where that is NaN; roll stays level."""
        pitch = yaw = nan
        if all(map(isfinite, f.q)):
            _, pitch, yaw = roll_pitch_yaw_of(quat_from_wxyz(f.q))
        self._point(sender, f, pitch, yaw, f.angular_velocity_y, f.angular_velocity_z)

    def pitchyaw_received(self, sender: Sender, f: Any) -> None:
        """Points the gimbal by angles and rates [rad, rad/s]; NaN leaves an axis alone."""
        self._point(sender, f, f.pitch, f.yaw, f.pitch_rate, f.yaw_rate)

    def manual_received(self, sender: Sender, f: Any) -> None:
        """Points the gimbal by a pilot's stick: fractions of its range, or of its largest rate."""
        pitch = f.pitch * (PITCH_MAX if f.pitch > 0.0 else -PITCH_MIN)
        self._point(sender, f, pitch, f.yaw * YAW_MAX, f.pitch_rate * RATE_MAX, f.yaw_rate * RATE_MAX)
