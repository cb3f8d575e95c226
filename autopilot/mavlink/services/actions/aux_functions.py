"""Functions of switches, by ArduPilot's numbers: DO_AUX_FUNCTION, and switches on radio channels (RCx_OPTION).

In: a function's number and the position of its switch. Out: what the vehicle is asked for. A switch on a channel acts
when it moves; where it stands when it is first seen does nothing.
"""

from collections.abc import Callable, Mapping
from enum import IntEnum

from pymavlink.dialects.v20 import all as mavlink

from autopilot.ardupilot_only_params import OPTION_CHANNELS
from autopilot.interface.client_requests import ChangeMode, SetCurrentItem
from autopilot.interface.item_lists import ListKind, MissionItem
from autopilot.interface.vehicle_state import ACCEPTED, FenceLimit, Mode, Reply, Severity, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.mavlink.wire.convert import whole

_HIGH_US, _LOW_US = 1800, 1200
_NAN = float("nan")
_ALL_LIMITS = FenceLimit.CEILING | FenceLimit.RADIUS | FenceLimit.SHAPES | FenceLimit.FLOOR

RELAYS: Mapping[int, int] = {28: 0, 34: 1, 35: 2, 36: 3, 66: 4, 67: 5}
SAVE_WAYPOINT, CAMERA_TRIGGER, FENCE, GRIPPER, MISSION_RESET, MOTOR_STOP = 7, 9, 11, 19, 24, 31
CLEAR_MISSION, GPS_DISABLE, DISARM, ARM_DISARM, ARM_DISARM_OLD, CAMERA_VIDEO = 58, 65, 81, 153, 41, 166


class Position(IntEnum):
    """Of a switch."""

    LOW = 0
    MIDDLE = 1
    HIGH = 2


class AuxFunctions(Service):
    """Carries out what switches mean."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._is_ardupilot = endpoint.dialect.name == "ardupilot"
        self._modes = {
            spec.aux_function: spec.mode for spec in endpoint.vehicle.modes.values() if spec.aux_function is not None
        }
        self._mode_before = Mode.HOLD
        self._seen_count = 0  # of stick messages
        self._switches: dict[int, tuple[int, Position]] = {}  # by channel: its function, and where it stands
        self._functions: dict[int, Callable[[Position], Reply]] = {
            SAVE_WAYPOINT: self._when_high(self._save_waypoint),
            CAMERA_TRIGGER: self._when_high(self._take_photo),
            FENCE: self._switch_fence,
            GRIPPER: self._grip,
            MISSION_RESET: self._when_high(lambda: self._endpoint.vehicle.request(SetCurrentItem(0))),
            MOTOR_STOP: self._when_high(endpoint.vehicle.terminate),
            CLEAR_MISSION: self._when_high(self._clear_mission),
            GPS_DISABLE: self._disable_gnss,
            DISARM: self._when_high(lambda: self._endpoint.vehicle.disarm(force=False)),
            ARM_DISARM: self._arm_or_disarm,
            ARM_DISARM_OLD: self._arm_or_disarm,
            CAMERA_VIDEO: self._film,
        }

    def commands(self) -> Mapping[int, CommandHandler]:
        return {mavlink.MAV_CMD_DO_AUX_FUNCTION: self._do_function}

    def _do_function(self, command: Command) -> Reply:
        """Does what a switch with a function would do (ArduPilot's dialect).

        Params: p1 function: 4 RTL, 16 Auto, 18 Land, 33 Brake, 42 Smart RTL, 52 Acro, 55 Guided, 56 Loiter, 57 Follow,
        68 Stabilize, 69 PosHold, 70 Alt Hold, 72 Circle (p2 below 2: back to the mode before); 7 saves a waypoint, 9
        takes a photo, 11 fence, 19 gripper, 24 mission from its first item, 28, 34, 35, 36, 66, 67 relays, 31 stops the
        motors for good, 41 and 153 arm or disarm, 58 clears the mission, 65 takes the simulated GNSS away, 81 disarms,
        166 films; p2 position of the switch, 0 low, 1 middle, 2 high.
        Refused: DENIED for another function or position; UNSUPPORTED in PX4's dialect; as what is asked for is.
        """
        if not self._is_ardupilot:
            return Reply(Verdict.UNSUPPORTED)
        position = whole(command.p2, -1)
        if position not in (0, 1, 2):
            return denied("parameter 2 must be 0 (low), 1 (middle) or 2 (high)")
        return self.run(whole(command.p1, -1), Position(position))

    def run(self, function: int, position: Position) -> Reply:
        """Does what a function asks for at a position of its switch."""
        if function in self._modes:
            return self._change_mode(self._modes[function], position)
        if function in RELAYS:
            return self._payload(mavlink.MAV_CMD_DO_SET_RELAY, RELAYS[function], float(position is Position.HIGH))
        if function in self._functions:
            return self._functions[function](position)
        return denied(f"there is no auxiliary function {function}")

    def frame(self) -> None:
        """Looks at the switches on radio channels, when a message of the sticks has come."""
        sticks = self._endpoint.vehicle.state.sticks
        if not self._is_ardupilot or sticks.count == self._seen_count:
            return
        self._seen_count = sticks.count
        params = self._endpoint.vehicle.params
        for channel in range(1, OPTION_CHANNELS + 1):
            pulse_us = sticks.channels[channel - 1]
            name = f"RC{channel}_OPTION"
            function = int(params[name]) if name in params else 0
            if function == 0 or pulse_us == 0:
                self._switches.pop(channel, None)
                continue
            position = Position((pulse_us >= _LOW_US) + (pulse_us > _HIGH_US))
            before = self._switches.get(channel)
            self._switches[channel] = (function, position)
            if before is not None and before[0] == function and before[1] is not position:
                reply = self.run(function, position)
                if reply.verdict is not Verdict.ACCEPTED:
                    self._endpoint.text_once(Severity.WARNING, f"{name} {function}: {reply.reason}")

    def _change_mode(self, mode: Mode, position: Position) -> Reply:
        """High: this mode; otherwise back from it to the one before."""
        vehicle = self._endpoint.vehicle
        now = vehicle.state.mode
        if position is not Position.HIGH:
            return vehicle.request(ChangeMode(self._mode_before)) if now is mode else ACCEPTED
        reply = vehicle.request(ChangeMode(mode))
        if reply.verdict is Verdict.ACCEPTED and now is not mode:
            self._mode_before = now
        return reply

    @staticmethod
    def _when_high(act: Callable[[], Reply]) -> Callable[[Position], Reply]:
        return lambda position: act() if position is Position.HIGH else ACCEPTED

    def _payload(self, command: int, p1: float = 0.0, p2: float = 0.0, p3: float = 0.0) -> Reply:
        return self._endpoint.vehicle.payload.run(command, (p1, p2, p3, 0.0), _NAN, _NAN, _NAN)

    def _take_photo(self) -> Reply:
        return self._payload(mavlink.MAV_CMD_IMAGE_START_CAPTURE, 0.0, 0.0, 1.0)

    def _film(self, position: Position) -> Reply:
        is_high = position is Position.HIGH
        return self._payload(mavlink.MAV_CMD_VIDEO_START_CAPTURE if is_high else mavlink.MAV_CMD_VIDEO_STOP_CAPTURE)

    def _switch_fence(self, position: Position) -> Reply:
        fence = self._endpoint.vehicle.fence
        return fence.enable(_ALL_LIMITS) if position is Position.HIGH else fence.disable(_ALL_LIMITS)

    def _grip(self, position: Position) -> Reply:
        if position is Position.MIDDLE:
            return ACCEPTED
        return self._payload(mavlink.MAV_CMD_DO_GRIPPER, 1.0, float(position is Position.HIGH))

    def _arm_or_disarm(self, position: Position) -> Reply:
        vehicle = self._endpoint.vehicle
        if position is Position.MIDDLE:
            return ACCEPTED
        return vehicle.arm(force=False) if position is Position.HIGH else vehicle.disarm(force=False)

    def _disable_gnss(self, position: Position) -> Reply:
        params = self._endpoint.vehicle.params
        if "SIM_GPS1_ENABLE" not in params:
            return Reply(Verdict.UNSUPPORTED, "there is no simulated GNSS")
        params.set("SIM_GPS1_ENABLE", position is not Position.HIGH)
        return ACCEPTED

    def _clear_mission(self) -> Reply:
        refusal = self._endpoint.vehicle.lists.load(ListKind.MISSION, [])
        return ACCEPTED if refusal is None else denied(refusal.reason)

    def _save_waypoint(self) -> Reply:
        """Where the vehicle is becomes the mission's last item; in an empty one behind a take-off to that height."""
        vehicle = self._endpoint.vehicle
        state = vehicle.state
        if not state.is_flying or state.mode is Mode.MISSION:
            return Reply(Verdict.TEMPORARILY_REJECTED, "waypoints are saved in the air, and not in Auto")
        home = state.home or state.origin
        items = list(vehicle.lists.items(ListKind.MISSION))
        position = (state.position.lat_deg, state.position.lon_deg, state.position.alt_m - home.alt_m)
        for command in (mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_WAYPOINT)[1 if items else 0 :]:
            frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
            items.append(MissionItem(len(items), frame, command, (0.0, 0.0, 0.0, _NAN), *position))
        refusal = vehicle.lists.load(ListKind.MISSION, items)
        return ACCEPTED if refusal is None else denied(refusal.reason)
