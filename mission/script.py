"""A MAVLink client for scripts, in simulated time.

A script is a coroutine that awaits the methods of a `Drone`. Everything it does goes over MAVLink, through memory
(lockstep with the simulation: deterministic) or UDP (any running vehicle); its clock is the vehicle's.

    async def script(drone: Drone) -> None:
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(10.0)
        await drone.goto_ned(20.0, 0.0, -10.0)
        await drone.land()
"""

from collections.abc import Callable, Coroutine
from math import dist, isnan, nan
from typing import Any

from common.geodesy import GeoPoint, geodetic_from_ned, ned_from_geodetic
from mission.client import Client, CommandRefused, ScriptError, ScriptTimeout
from mission.plan.plan_file import Plan
from mission.plan.plan_lists import FENCE_LIST, RALLY_LIST, fence_items, rally_items

TAKEOFF_M = 2.5  # the vehicle's least; a companion goes on from there
FORCE_MAGIC = 21196.0  # param2 of COMPONENT_ARM_DISARM that skips the checks

CMD_RETURN_TO_LAUNCH = 20
CMD_LAND = 21
CMD_TAKEOFF = 22
CMD_SET_MODE = 176
CMD_CHANGE_SPEED = 178
CMD_REPOSITION = 192
CMD_MISSION_START = 300
CMD_ARM_DISARM = 400
CMD_RUN_PREARM_CHECKS = 401

MAIN_AUTO = 4
MAIN_OFFBOARD = 6
AUTO_LOITER = 3
AUTO_MISSION = 4
AUTO_RTL = 5
AUTO_LAND = 6

FRAME_GLOBAL = 0
FRAME_LOCAL_NED = 1
LANDED_ON_GROUND = 1
GROUND_ROVER = 10  # MAV_TYPE
MISSION_COMPLETE = 5

# SET_POSITION_TARGET_LOCAL_NED type_mask: a set bit frees the element
FREE_POSITION = 0b000_000_000_111
FREE_VELOCITY = 0b000_000_111_000
FREE_ACCELERATION = 0b000_111_000_000
FREE_YAW = 1 << 10
FREE_YAW_RATE = 1 << 11
# SET_ATTITUDE_TARGET type_mask
FREE_BODY_RATES = 0b111
FREE_ATTITUDE = 1 << 7

_SAYS_S = 0.5  # until it has said why it may not be armed
SENSOR_PREARM = 1 << 28  # MAV_SYS_STATUS_PREARM_CHECK


class Drone(Client):
    """The vehicle, as a script sees it: its own telemetry, and actions that return when they are done."""

    needs: tuple[str, ...] = ()
    """Messages that it has to be sent besides those that every autopilot sends, or is asked for."""

    # -- what it tells ----------------------------------------------------------------------------------------------

    @property
    def is_armed(self) -> bool:
        heartbeat = self.latest("HEARTBEAT")
        return heartbeat is not None and bool(heartbeat.base_mode & 128)

    @property
    def drives(self) -> bool:
        """It stays on the ground."""
        heartbeat = self.latest("HEARTBEAT")
        return heartbeat is not None and bool(heartbeat.type == GROUND_ROVER)

    @property
    def px4_mode(self) -> tuple[int, int]:
        """Main and sub mode of the last heartbeat."""
        heartbeat = self.latest("HEARTBEAT")
        custom = 0 if heartbeat is None else heartbeat.custom_mode
        return custom >> 16 & 0xFF, custom >> 24

    @property
    def is_ready(self) -> bool:
        """The vehicle's own arming checks pass and it knows its home."""
        status = self.latest("SYS_STATUS")
        return (
            status is not None
            and bool(status.onboard_control_sensors_health & SENSOR_PREARM)
            and self.latest("HOME_POSITION") is not None
        )

    @property
    def is_landed(self) -> bool:
        state = self.latest("EXTENDED_SYS_STATE")
        return state is not None and state.landed_state == LANDED_ON_GROUND

    @property
    def is_mission_complete(self) -> bool:
        """As the vehicle says; a mission that ends with a return is complete when the return begins."""
        current = self.latest("MISSION_CURRENT")
        return current is not None and current.mission_state == MISSION_COMPLETE

    @property
    def home(self) -> GeoPoint:
        """Raises ScriptError while the vehicle has none."""
        message = self.latest("HOME_POSITION")
        if message is None:
            raise ScriptError("the vehicle has no home position yet")
        return GeoPoint(message.latitude * 1e-7, message.longitude * 1e-7, message.altitude * 1e-3)

    @property
    def pos_ned(self) -> tuple[float, float, float]:
        """[m] The vehicle's own estimate, in its local frame."""
        message = self.latest("LOCAL_POSITION_NED")
        return (nan, nan, nan) if message is None else (message.x, message.y, message.z)

    @property
    def vel_ned(self) -> tuple[float, float, float]:
        """[m/s] As `pos_ned`."""
        message = self.latest("LOCAL_POSITION_NED")
        return (nan, nan, nan) if message is None else (message.vx, message.vy, message.vz)

    # -- actions ----------------------------------------------------------------------------------------------------

    async def wait_ready(self, timeout_s: float = 60.0) -> None:
        """Returns when the vehicle may be armed and knows its home; the ScriptTimeout says why it may not."""
        try:
            await self.until(lambda: self.is_ready, timeout_s, "ready to arm")
        except ScriptTimeout as timeout:
            heard = len(self.texts)
            self._end.command(CMD_RUN_PREARM_CHECKS)
            await self.sleep(_SAYS_S)
            said = [text for text in self.texts[heard:] if text.startswith("PreArm: ")]
            reasons = ", ".join(text.removeprefix("PreArm: ") for text in said)
            raise ScriptTimeout(": ".join(filter(None, (str(timeout), reasons)))) from timeout

    async def arm(self, *, force: bool = False) -> None:
        if not self.is_armed and self.px4_mode in ((MAIN_AUTO, AUTO_RTL), (MAIN_AUTO, AUTO_LAND)):
            await self.hold()  # a vehicle that follows ArduPilot stays in them, and is not armed there
        await self.command(CMD_ARM_DISARM, 1.0, FORCE_MAGIC if force else 0.0, name="arm")
        await self.until(lambda: self.is_armed, 2.0, "armed")

    async def disarm(self, *, force: bool = False) -> None:
        await self.command(CMD_ARM_DISARM, 0.0, FORCE_MAGIC if force else 0.0, name="disarm")
        await self.until(lambda: not self.is_armed, 2.0, "disarmed")

    async def takeoff(self, height_m: float, timeout_s: float = 60.0) -> None:
        """Climbs to a height above home and returns when it holds there."""
        alt_amsl_m = self.home.alt_m + height_m
        await self.command(CMD_TAKEOFF, nan, 0.0, 0.0, nan, nan, nan, alt_amsl_m, name="takeoff")
        await self.until(lambda: abs(self._height_m() - height_m) < 0.3, timeout_s, f"takeoff to {height_m:g} m")
        await self.until(lambda: self.px4_mode == (MAIN_AUTO, AUTO_LOITER), timeout_s, "hold after takeoff")

    async def goto(
        self,
        lat_deg: float,
        lon_deg: float,
        alt_amsl_m: float,
        *,
        yaw_rad: float = nan,
        speed_m_s: float = -1.0,
        acceptance_m: float = 0.5,
        timeout_s: float = 120.0,
    ) -> None:
        """Goes to a place and returns when it is within `acceptance_m` of it; what drives takes the ground's height."""
        await self.command_int(
            CMD_REPOSITION,
            FRAME_GLOBAL,
            (speed_m_s, 1.0, 0.0, yaw_rad),
            round(lat_deg * 1e7),
            round(lon_deg * 1e7),
            alt_amsl_m,
            name="goto",
        )
        await self._until_there(lat_deg, lon_deg, alt_amsl_m, acceptance_m, timeout_s)

    async def _until_there(
        self, lat_deg: float, lon_deg: float, alt_amsl_m: float, acceptance_m: float, timeout_s: float
    ) -> None:
        target = ned_from_geodetic(lat_deg, lon_deg, alt_amsl_m, self.origin)
        await self.until(lambda: self._way_left_m(target) < acceptance_m, timeout_s, "goto")

    async def goto_ned(self, north_m: float, east_m: float, down_m: float, **options: Any) -> None:
        """`goto` for a place in the vehicle's local frame."""
        await self.goto(*geodetic_from_ned(north_m, east_m, down_m, self.origin), **options)

    async def hold(self) -> None:
        await self._set_mode(MAIN_AUTO, AUTO_LOITER, "hold")

    async def change_speed(self, speed_m_s: float) -> None:
        await self.command(CMD_CHANGE_SPEED, 1.0, speed_m_s, -1.0, name="change speed")

    async def start_mission(self, first: int = 0) -> None:
        """Flies the mission from item `first`; the vehicle must be armed or is armed on the ground."""
        self.reached.clear()
        await self.command(CMD_MISSION_START, float(first), 0.0, name="start mission")
        if not self.is_armed:
            await self.arm()

    async def pause_mission(self) -> None:
        await self.hold()

    async def resume_mission(self) -> None:
        await self._set_mode(MAIN_AUTO, AUTO_MISSION, "resume mission")

    async def wait_mission_finished(self, last_seq: int, timeout_s: float = 900.0) -> None:
        """Returns when the last item has been reached."""
        await self.until(lambda: last_seq in self.reached, timeout_s, "mission finished")

    async def return_home(self) -> None:
        await self._set_mode(MAIN_AUTO, AUTO_RTL, "return")

    async def land(self, timeout_s: float = 120.0) -> None:
        """Lands here and returns when the motors have stopped."""
        await self.command(CMD_LAND, 0.0, 0.0, 0.0, nan, nan, nan, nan, name="land")
        await self.wait_disarmed(timeout_s)

    async def wait_disarmed(self, timeout_s: float = 120.0) -> None:
        await self.until(lambda: self.is_landed and not self.is_armed, timeout_s, "landed and disarmed")

    # -- offboard ---------------------------------------------------------------------------------------------------

    def offboard_position(self, north_m: float, east_m: float, down_m: float, yaw_rad: float = nan) -> None:
        """From now on streams this position of the local frame, at 20 Hz."""
        mask = FREE_VELOCITY | FREE_ACCELERATION | FREE_YAW_RATE | (FREE_YAW if isnan(yaw_rad) else 0)
        self._stream_local(mask, FRAME_LOCAL_NED, pos=(north_m, east_m, down_m), yaw_rad=yaw_rad)

    def offboard_velocity(
        self, north_m_s: float, east_m_s: float, down_m_s: float, yaw_rad: float = nan, frame: int = FRAME_LOCAL_NED
    ) -> None:
        """From now on streams this velocity, in the local frame or a body frame (MAV_FRAME)."""
        mask = FREE_POSITION | FREE_ACCELERATION | FREE_YAW_RATE | (FREE_YAW if isnan(yaw_rad) else 0)
        self._stream_local(mask, frame, vel=(north_m_s, east_m_s, down_m_s), yaw_rad=yaw_rad)

    def offboard_attitude(self, wxyz: tuple[float, float, float, float], thrust: float) -> None:
        """From now on streams this attitude (w, x, y, z: body frd to ned) and thrust [0..1]."""
        self._offboard = lambda time_ms: self.ask(
            "SET_ATTITUDE_TARGET",
            time_boot_ms=time_ms,
            type_mask=FREE_BODY_RATES,
            q=wxyz,
            body_roll_rate=0.0,
            body_pitch_rate=0.0,
            body_yaw_rate=0.0,
            thrust=thrust,
        )

    def offboard_rates(self, omega_frd: tuple[float, float, float], thrust: float) -> None:
        """From now on streams these body rates [rad/s] and thrust [0..1]."""
        self._offboard = lambda time_ms: self.ask(
            "SET_ATTITUDE_TARGET",
            time_boot_ms=time_ms,
            type_mask=FREE_ATTITUDE,
            q=(1.0, 0.0, 0.0, 0.0),
            body_roll_rate=omega_frd[0],
            body_pitch_rate=omega_frd[1],
            body_yaw_rate=omega_frd[2],
            thrust=thrust,
        )

    async def start_offboard(self) -> None:
        """Switches to OFFBOARD; a setpoint must be streaming."""
        if self._offboard is None:
            raise ScriptError("start_offboard: set an offboard setpoint first")
        await self.sleep(0.5)  # PX4 wants a stream before the switch
        await self._set_mode(MAIN_OFFBOARD, 0, "offboard")

    async def let_companion_fly(self, timeout_s: float = 5.0) -> None:
        """Switches to OFFBOARD for the setpoints of a companion computer on board.

        Args:
            timeout_s: how long to ask: a companion that has just been stopped is silent for a while.
        """
        end_us = self.time_us + int(timeout_s * 1e6)
        while True:
            try:
                return await self._set_mode(MAIN_OFFBOARD, 0, "offboard")
            except CommandRefused:
                if self.time_us >= end_us:
                    raise
            await self.sleep(0.5)

    async def stop_offboard(self) -> None:
        """Holds here and stops streaming."""
        await self.hold()
        self._offboard = None

    def _stream_local(
        self,
        mask: int,
        frame: int,
        *,
        pos: tuple[float, float, float] = (0.0, 0.0, 0.0),
        vel: tuple[float, float, float] = (0.0, 0.0, 0.0),
        yaw_rad: float,
    ) -> None:
        fields = {
            "coordinate_frame": frame,
            "type_mask": mask,
            **dict(zip(("x", "y", "z"), pos, strict=True)),
            **dict(zip(("vx", "vy", "vz"), vel, strict=True)),
            **dict.fromkeys(("afx", "afy", "afz", "yaw_rate"), 0.0),
            "yaw": 0.0 if isnan(yaw_rad) else yaw_rad,
        }
        self._offboard = lambda time_ms: self.ask("SET_POSITION_TARGET_LOCAL_NED", time_boot_ms=time_ms, **fields)

    async def choose_mode(self, custom_mode: int, name: str) -> None:
        """Switches to a mode by PX4's number, that of a heartbeat; the vehicle says if it cannot."""
        await self._set_mode(custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF, name)

    # -- helpers ----------------------------------------------------------------------------------------------------

    async def _set_mode(self, main: int, sub: int, name: str) -> None:
        await self.command(CMD_SET_MODE, 1.0, float(main), float(sub), name=name)
        await self.until(lambda: self.px4_mode == (main, sub), 3.0, f"mode {name}")

    def _way_left_m(self, target_ned: tuple[float, float, float]) -> float:
        axes = 2 if self.drives else 3
        return dist(self.pos_ned[:axes], target_ned[:axes])

    def _height_m(self) -> float:
        """Above home."""
        message = self.latest("HOME_POSITION")
        return nan if message is None else message.z - self.pos_ned[2]

    @property
    def origin(self) -> GeoPoint:
        """Of the local frame, from the home position, which is known in both frames."""
        message = self.latest("HOME_POSITION")
        if message is None:
            raise ScriptError("the vehicle has no home position yet")
        home = self.home
        lat_deg, lon_deg, _ = geodetic_from_ned(-message.x, -message.y, 0.0, home)
        return GeoPoint(lat_deg, lon_deg, home.alt_m + message.z)


async def start_plan(drone: Drone, plan: Plan) -> None:
    """Uploads a plan, with fence and rally points if it has any, and starts it.

    Raises:
        ScriptError: the vehicle refused it.
    """
    await drone.wait_ready()
    if plan.fence:
        await drone.upload(fence_items(plan), FENCE_LIST)
    if plan.rally:
        await drone.upload(rally_items(plan), RALLY_LIST)
    await drone.upload(plan.items)
    await drone.start_mission()


async def fly_plan(drone: Drone, plan: Plan) -> None:
    """Uploads a plan, with fence and rally points if it has any, and flies it.

    If it ends on the ground, waits until the motors stop.

    Raises:
        ScriptError: the vehicle refused it, or did something else in the end.
    """
    first_text = len(drone.texts)
    await start_plan(drone, plan)
    last = plan.items[-1]
    if last.command in (CMD_LAND, CMD_RETURN_TO_LAUNCH):
        await drone.wait_disarmed(timeout_s=3600.0)
    else:
        await drone.until(lambda: last.seq in drone.reached or not drone.is_armed, 3600.0, "mission finished")
    if last.seq not in drone.reached and not drone.is_mission_complete:
        current = drone.latest("MISSION_CURRENT")
        where = "" if current is None else f" at item {current.seq + 1}"
        raise ScriptError(f"the flight ended before the mission did{where} ({'; '.join(drone.texts[first_text:])})")


async def take_off(drone: Drone) -> None:
    """Up to where a companion takes over."""
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(TAKEOFF_M)


async def set_out(drone: Drone) -> None:
    """Armed, and up to where a companion takes over, of what flies."""
    if drone.drives:
        await drone.wait_ready()
        await drone.arm()
    else:
        await take_off(drone)


Script = Callable[[Drone], Coroutine[Any, Any, Any]]

__all__ = ["Drone", "Script", "ScriptError", "ScriptTimeout", "fly_plan", "set_out", "start_plan", "take_off"]
