"""A ground station with a rover in ArduPilot's dialect."""

from math import cos, degrees, hypot, sin

from autopilot.ports import POSITION_VALID
from common.geodesy import geodetic_from_ned
from tests.system.published.published_rules import CMD_ARM, E7, Station

MANUAL, HOLD, LOITER, FOLLOW, SIMPLE, DOCK, CIRCLE = 0, 4, 5, 6, 7, 8, 9  # ROVER_MODE
AUTO, RTL, SMART_RTL, GUIDED = 10, 11, 12, 15
CHANGE_SPEED, SET_REVERSE, SET_YAW_SPEED = 178, 194, 213
_FREE = dict.fromkeys(("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate"), 0.0)
POSITION, VELOCITY, VELOCITY_YAW_RATE, YAW, YAW_RATE = 3580, 3559, 1511, 2559, 1535  # type masks
ATTITUDE, TURN = 0b111, 0b1000_0011  # of SET_ATTITUDE_TARGET: by attitude, by yaw rate


class Rover(Station):
    """A ground station with a rover, armed in a mode by `armed`."""

    def __init__(self, airframe="rover", **arguments):
        super().__init__(config={"airframe": airframe}, **arguments)

    async def armed(self, mode=GUIDED):
        await self.client.until(lambda: self.flown.state.estimate.flags & POSITION_VALID, 60.0, "a position")
        await self.mode(mode)
        await self.client.until(lambda: self.flown.state.is_ready_to_arm, 60.0, "ready")
        await self.client.command(CMD_ARM, 1.0, name="arm")

    async def target(self, mask, seconds=0.0, frame=1, **fields):
        for _ in range(max(round(seconds * 4.0), 1)):
            self.client.send("SET_POSITION_TARGET_LOCAL_NED", time_boot_ms=0, target_system=1, target_component=1,
                             coordinate_frame=frame, type_mask=mask, **(_FREE | fields))  # fmt: skip
            await self.client.sleep(0.25)

    async def attitude(self, mask, thrust, seconds, yaw=0.0, yaw_rate=0.0):
        for _ in range(round(seconds * 4.0)):
            self.client.send("SET_ATTITUDE_TARGET", time_boot_ms=0, target_system=1, target_component=1, type_mask=mask,
                             q=[cos(yaw / 2), 0.0, 0.0, sin(yaw / 2)], body_roll_rate=0.0, body_pitch_rate=0.0,
                             body_yaw_rate=yaw_rate, thrust=thrust)  # fmt: skip
            await self.client.sleep(0.25)

    async def shows_dock(self, north, east):
        """A companion sees a docking target that stands there, for ever."""
        while True:
            yaw, away = self.flown.state.yaw_rad, (north - self.flown.pos[0], east - self.flown.pos[1])
            ahead, right = cos(yaw) * away[0] + sin(yaw) * away[1], cos(yaw) * away[1] - sin(yaw) * away[0]
            self.client.send("LANDING_TARGET", time_usec=0, target_num=0, frame=12, angle_x=0.0, angle_y=0.0,
                             distance=0.0, size_x=0.0, size_y=0.0, x=ahead, y=right, z=0.0, q=[1.0, 0.0, 0.0, 0.0],
                             type=0, position_valid=1)  # fmt: skip
            await self.client.sleep(0.1)

    def tell_target(self, place, velocity):
        """Somebody to be followed says where it is and how it moves."""
        lat_deg, lon_deg, alt_m = geodetic_from_ned(*place, 0.0, self.flown.state.origin)
        where = {"lat": round(lat_deg * E7), "lon": round(lon_deg * E7), "alt": alt_m, "vel": [*velocity, 0.0]}
        none = dict.fromkeys(("acc", "rates", "position_cov"), [0.0] * 3)
        rest = {"timestamp": 0, "est_capabilities": 3, "attitude_q": [1.0, 0.0, 0.0, 0.0], "custom_state": 0}
        self.client.send("FOLLOW_TARGET", **where, **none, **rest)

    async def there(self, north, east, within_m=1.5, seconds=60.0):
        await self.client.until(lambda: self.away(north, east) < within_m, seconds, f"at {north}, {east}")

    def away(self, north, east):
        return hypot(self.flown.pos[0] - north, self.flown.pos[1] - east)

    @property
    def speed(self):
        """Along the nose."""
        yaw = self.flown.state.yaw_rad
        return cos(yaw) * self.flown.vel[0] + sin(yaw) * self.flown.vel[1]

    def said(self, words):
        return any(words in text for text in self.client.texts)

    def turned_deg(self, yaw):
        return (degrees(self.flown.state.yaw_rad - yaw) + 180.0) % 360.0 - 180.0
