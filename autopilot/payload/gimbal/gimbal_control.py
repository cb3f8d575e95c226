"""Who points the gimbal, and how: angles, rates, places, and the older mount commands.

In: commands of clients and mission items. Out: the gimbal's aim. Clients take control before they point it; while
nobody has it, everybody may.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from math import isfinite, isnan, nan, radians

from autopilot.interface.vehicle_state import ACCEPTED, Reply, VehicleState, Verdict
from autopilot.payload.gimbal.gimbal import Gimbal
from autopilot.payload.payloads import Params
from common.attitude import wrapped
from common.geodesy import ned_from_geodetic

DEVICE_ID = 154  # MAV_COMP_ID_GIMBAL

Client = tuple[int, int]  # system and component id
NOBODY: Client = (0, 0)
AUTOPILOT: Client = (-1, -1)  # a mission item; its system id is known to the MAVLink part only


class Command(IntEnum):
    """What the gimbal takes, numbered as MAV_CMD."""

    NAV_ROI = 80
    SET_ROI_LOCATION = 195
    SET_ROI_NEXT = 196
    SET_ROI_NONE = 197
    SET_ROI = 201
    MOUNT_CONFIGURE = 204
    MOUNT_CONTROL = 205
    MANAGER_PITCHYAW = 1000
    MANAGER_CONFIGURE = 1001


class Flag(IntFlag):
    """Numbered as GIMBAL_MANAGER_FLAGS."""

    RETRACT = 1
    NEUTRAL = 2
    ROLL_LOCK = 4
    PITCH_LOCK = 8
    YAW_LOCK = 16
    YAW_IN_VEHICLE_FRAME = 32
    YAW_IN_EARTH_FRAME = 64


@dataclass(slots=True)
class Control:
    """Who has control; (0, 0) is nobody."""

    primary: Client = NOBODY
    secondary: Client = NOBODY


class GimbalControl:
    """Points one gimbal (autopilot.payload.payloads.Payload).

    Args:
        gimbal: what is pointed.
        state: the vehicle that carries it.
    """

    def __init__(self, gimbal: Gimbal, state: VehicleState) -> None:
        self.gimbal = gimbal
        self.control = Control()
        self._state = state
        self._handlers: dict[int, Callable[[Params, float, float, float, Client], Reply]] = {
            Command.NAV_ROI: self._set_roi,
            Command.SET_ROI: self._set_roi,
            Command.SET_ROI_LOCATION: lambda _, x, y, z, client: self._look_at(x, y, z, client),
            Command.SET_ROI_NEXT: lambda _, __, ___, ____, client: self._look_away(client),
            Command.SET_ROI_NONE: lambda _, __, ___, ____, client: self._look_away(client),
            Command.MOUNT_CONFIGURE: self._mount_configure,
            Command.MOUNT_CONTROL: self._mount_control,
            Command.MANAGER_PITCHYAW: self._pitchyaw,
            Command.MANAGER_CONFIGURE: self._configure,
        }

    # autopilot.payload.payloads.Payload

    def takes(self, command: int) -> bool:
        return command in self._handlers

    def run(self, command: int, params: Params, x: float, y: float, z: float) -> Reply:
        return self.run_for(AUTOPILOT, command, params, x, y, z)

    def run_for(self, client: Client, command: int, params: Params, x: float, y: float, z: float) -> Reply:
        """Carries a command of a client out; x, y and z as in autopilot.payload.payloads."""
        return self._handlers[command](params, x, y, z, client)

    # Control

    def refusal(self, client: Client) -> Reply | None:
        """Why a client may not point the gimbal now."""
        control = self.control
        if control.primary == NOBODY or client in (control.primary, control.secondary, AUTOPILOT):
            return None
        sysid, compid = control.primary
        owner = "a mission" if control.primary == AUTOPILOT else f"{sysid}/{compid}"
        return Reply(Verdict.DENIED, f"not in control of the gimbal: {owner} is")

    def _configure(self, params: Params, _: float, __: float, device: float, client: Client) -> Reply:
        if not _is_ours(device):
            return Reply(Verdict.DENIED, f"there is no gimbal {device:g}")
        primary = _claimed(params[0], params[1], self.control.primary, client)
        secondary = _claimed(params[2], params[3], self.control.secondary, client)
        if primary is None or secondary is None:
            return Reply(Verdict.DENIED, "ids must be -3 to 255")
        self.control = Control(primary, secondary)
        return ACCEPTED

    # Pointing

    def _pitchyaw(self, params: Params, flags: float, _: float, device: float, client: Client) -> Reply:
        if not _is_ours(device):
            return Reply(Verdict.DENIED, f"there is no gimbal {device:g}")
        pitch, yaw, pitch_rate, yaw_rate = (radians(value) for value in params)
        number = int(flags) if isfinite(flags) and flags >= 0.0 else 0
        return self.point(client, number, pitch, yaw, pitch_rate, yaw_rate)

    def point(
        self, client: Client, flags: int, pitch: float, yaw: float, pitch_rate: float = nan, yaw_rate: float = nan
    ) -> Reply:
        """Points by angles and rates [rad, rad/s], NaN for an axis that is left alone.

        Args:
            client: who asks.
            flags: GIMBAL_MANAGER_FLAGS; they say whether yaw holds its direction, and where it is counted from.
            pitch: from the horizon, up is positive.
            yaw: from the nose or from north.
            pitch_rate: used where the angle is NaN.
            yaw_rate: likewise.
        """
        refusal = self.refusal(client)
        if refusal is not None:
            return refusal
        if flags & Flag.RETRACT:
            return Reply(Verdict.DENIED, "the gimbal cannot be retracted")
        if flags & Flag.NEUTRAL:
            self.gimbal.neutral()
            return ACCEPTED
        is_locked = bool(flags & Flag.YAW_LOCK)
        is_from_north = is_locked
        if flags & Flag.YAW_IN_EARTH_FRAME:
            is_from_north = True
        elif flags & Flag.YAW_IN_VEHICLE_FRAME:
            is_from_north = False
        if is_from_north and not is_locked:
            yaw = wrapped(yaw - self._state.yaw_rad) if isfinite(yaw) else nan
        elif is_locked and not is_from_north:
            yaw = wrapped(yaw + self._state.yaw_rad) if isfinite(yaw) else nan
        if isfinite(pitch) or isfinite(yaw) or isfinite(pitch_rate) or isfinite(yaw_rate):
            self.gimbal.point(pitch, yaw, pitch_rate, yaw_rate, is_yaw_locked=is_locked)
        elif is_locked != self.gimbal.aim.is_yaw_locked:
            self.gimbal.point(nan, nan, is_yaw_locked=is_locked)
        return ACCEPTED

    def _look_at(self, lat_deg: float, lon_deg: float, alt_m: float, client: Client) -> Reply:
        refusal = self.refusal(client)
        if refusal is not None:
            return refusal
        if not (isfinite(lat_deg) and isfinite(lon_deg) and abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0):
            return Reply(Verdict.DENIED, "there is no such latitude and longitude")
        if isnan(alt_m):
            alt_m = (self._state.home or self._state.origin).alt_m
        self.gimbal.look_at(ned_from_geodetic(lat_deg, lon_deg, alt_m, self._state.origin))
        return ACCEPTED

    def _look_away(self, client: Client) -> Reply:
        refusal = self.refusal(client)
        if refusal is None:
            self.gimbal.look_away()
        return refusal or ACCEPTED

    def _set_roi(self, params: Params, x: float, y: float, z: float, client: Client) -> Reply:
        """The older forms: MAV_ROI in parameter 1, 0 none (but some send a position with it), 1 ahead, 3 a position."""
        has_position = isfinite(x) and isfinite(y) and (x != 0.0 or y != 0.0)
        if params[0] == 3.0 or (params[0] == 0.0 and has_position):
            return self._look_at(x, y, z, client)
        if params[0] in (0.0, 1.0):
            return self._look_away(client)
        return Reply(Verdict.UNSUPPORTED, "only a place can be looked at")

    # Older mount commands

    def _mount_configure(self, params: Params, _: float, __: float, ___: float, client: Client) -> Reply:
        refusal = self.refusal(client)
        if refusal is not None:
            return refusal
        if params[0] == 1.0:  # MAV_MOUNT_MODE: neutral
            self.gimbal.neutral()
            return ACCEPTED
        if params[0] == 2.0:
            self.gimbal.look_away()
            return ACCEPTED
        return Reply(Verdict.UNSUPPORTED, f"mount mode {params[0]:g} is not supported")

    def _mount_control(self, params: Params, lat_deg: float, lon_deg: float, mode: float, client: Client) -> Reply:
        refusal = self.refusal(client)
        if refusal is not None:
            return refusal
        if mode == 1.0:
            self.gimbal.neutral()
            return ACCEPTED
        if mode == 2.0:
            self.gimbal.point(radians(params[0]), radians(params[2]), is_yaw_locked=False)
            return ACCEPTED
        if mode == 4.0:  # a position; its altitude is parameter 4
            scale = 1e-7 if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0 else 1.0  # sent either way
            return self._look_at(lat_deg * scale, lon_deg * scale, params[3], client)
        if mode == 6.0 and self._state.home is not None:
            self.gimbal.look_at(self._state.home_ned)
            return ACCEPTED
        return Reply(Verdict.UNSUPPORTED, f"mount mode {mode:g} is not supported")


def _is_ours(device: float) -> bool:
    """Whether a command's gimbal is this one: 0 (all), 1, or its component id."""
    return isnan(device) or device in (0.0, 1.0, float(DEVICE_ID))


def _claimed(sysid: float, compid: float, now: Client, client: Client) -> Client | None:
    """Who has control after CONFIGURE; None: the ids make no sense. -1 keep, -2 the sender, -3 the sender no more."""
    if not (isfinite(sysid) and isfinite(compid)):
        return now
    if sysid == -1.0 or compid == -1.0:
        return now
    if sysid == -2.0 or compid == -2.0:
        return client
    if sysid == -3.0 or compid == -3.0:
        return NOBODY if now == client else now
    if not (0.0 <= sysid <= 255.0 and 0.0 <= compid <= 255.0):
        return None
    return int(sysid), int(compid)
