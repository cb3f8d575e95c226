"""What every navigator mode works with: the vehicle's state, the setpoint, and what it tells the commander."""

from collections.abc import Callable
from math import atan2, hypot, inf, isfinite, nan, sqrt

from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import LandedState, Mode, VehicleState
from autopilot.navigator.heading import Heading
from autopilot.navigator.setpoint import SetpointPort, Vector
from autopilot.ports import HEIGHT_VALID, TERRAIN_VALID
from autopilot.vehicles.planned_limits import planned_accel, planned_jerk
from autopilot.vehicles.vehicle_class import Craft, GroundHandling, VerticalLimits
from common.geodesy import geodetic_from_ned, ned_from_geodetic
from common.params import Parameter, ParameterTable

CLIMB_SPEED, DESCEND_SPEED = 2, 3  # SPEED_TYPE


class NavContext:
    """Shared by the modes of one vehicle.

    Args:
        state: the vehicle as of this frame.
        params: its parameters.
        announcer: where texts and mission progress go.
        setpoint: the port to the control part.
        craft: what its class and its airframe say of how it moves.
    """

    __slots__ = (
        "_numbers", "announcer", "climb_speed", "craft", "cruise_speed", "descend_speed", "fence_refusal", "find_path",
        "flown",
        "has_ended", "has_position", "heading", "is_landing", "leg_yaw", "next_hold", "params", "position_refusal",
        "setpoint", "state", "wants_lift", "wish", "yaw_mode",
    )  # fmt: skip

    def __init__(
        self,
        state: VehicleState,
        params: ParameterTable,
        announcer: Announcer,
        setpoint: SetpointPort,
        craft: Craft,
    ) -> None:
        self.state = state
        self.params = params
        self.announcer = announcer
        self.setpoint = setpoint
        self.craft = craft
        self.has_position = False  # the commander's judgement, with its delay
        self.wants_lift = False  # the mode asks to leave the ground
        self.is_landing = False  # the mode is on its last descent
        self.has_ended = False  # the mode stands where it was to lead; of a vehicle that stays on the ground
        self.position_refusal: Callable[[Vector], str] = lambda _position: (
            ""
        )  # why the fence lets nobody stay at a position [m]
        self.fence_refusal: Callable[[Vector], str] = lambda _position: ""  # why it lets nobody go to a position [m]
        self.find_path: Callable[[Vector, Vector], list[Vector] | None] = lambda _start, goal: [
            goal
        ]  # inside the fence
        self.flown = FlightMode()  # the present mode
        self.wish: Mode | None = None  # the mode that shall follow this one
        self.next_hold: tuple[Vector, float, bool] | None = None  # place, heading, whether to go there in a line
        self.cruise_speed = nan  # [m/s] asked for by DO_CHANGE_SPEED; NaN: the parameter
        self.climb_speed = nan
        self.descend_speed = nan
        self.leg_yaw = nan  # [rad] of the mission leg being flown
        self._numbers = {name: float(params[name]) for name in params}
        self.yaw_mode = self._yaw_mode()
        self.heading = Heading(self)
        params.on_change(self._on_parameter)

    def number(self, name: str) -> float:
        """The value of a parameter in its own unit."""
        return self._numbers[name]

    @property
    def is_on_ground(self) -> bool:
        return self.state.landed_state is LandedState.ON_GROUND

    @property
    def ground(self) -> GroundHandling:
        """How the vehicle leaves the ground and comes back; not for one that never does."""
        ground = self.craft.ground
        if ground is None:
            raise LookupError("a vehicle that never leaves the ground neither takes off nor lands")
        return ground

    @property
    def vertical(self) -> VerticalLimits:
        """How the vehicle climbs and descends; not for one whose heights are the ground's."""
        vertical = self.craft.limits.vertical
        if vertical is None:
            raise LookupError("a vehicle that stays on the ground neither climbs nor descends")
        return vertical

    def alt_radius(self) -> float:
        """Height error [m] at which a place counts as reached; on the ground any."""
        vertical = self.craft.limits.vertical
        return inf if vertical is None else self.number(vertical.alt_radius)

    @property
    def has_height(self) -> bool:
        return bool(self.state.estimate.flags & HEIGHT_VALID)

    def reset_speeds(self) -> None:
        """Forgets the speeds asked for by commands and mission items."""
        self.cruise_speed = self.climb_speed = self.descend_speed = nan

    def use_return_speed(self) -> None:
        """The speeds of a way home: RTL_RETURN_SPD, or the usual ones if that is not set."""
        self.reset_speeds()
        speed = self.number("RTL_RETURN_SPD")
        if speed > 0.0:
            self.cruise_speed = speed

    def set_speed(self, kind: int, speed_m_s: float) -> None:
        """Changes a speed (numbered as SPEED_TYPE: 2 climb, 3 descent, else horizontal); NaN: the parameter's."""
        if kind == CLIMB_SPEED:
            self.climb_speed = speed_m_s
        elif kind == DESCEND_SPEED:
            self.descend_speed = speed_m_s
        else:
            self.cruise_speed = speed_m_s

    def pos_ned_of(self, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Vector:
        """A geodetic position in the ned frame [m]."""
        return ned_from_geodetic(lat_deg, lon_deg, alt_amsl_m, self.state.origin)

    def geodetic_of(self, pos_ned: Vector) -> tuple[float, float, float]:
        """Latitude [deg], longitude [deg] and altitude above sea level [m] of a position [m]."""
        return geodetic_from_ned(*pos_ned, self.state.origin)

    def down_of(self, alt_amsl_m: float) -> float:
        """Down coordinate [m] of an altitude above the present position."""
        position = self.state.position
        return ned_from_geodetic(position.lat_deg, position.lon_deg, alt_amsl_m, self.state.origin)[2]

    def fly_to(
        self,
        pos_ned: Vector,
        yaw: float,
        path_start_ned: Vector | None = None,
        exit_speed: float = 0.0,
        pass_radius: float = 0.0,
    ) -> None:
        """Asks for a position with the speeds asked for; along a straight line if its start is given and not near."""
        if path_start_ned is not None and distance(path_start_ned, pos_ned) > 0.5:  # below that a line means nothing
            self.setpoint.fly_to(
                pos_ned,
                yaw,
                path_start_ned=path_start_ned,
                cruise_speed=self.cruise_speed,
                climb_speed=self.climb_speed,
                descend_speed=self.descend_speed,
                exit_speed=exit_speed,
                pass_radius=pass_radius,
            )
        else:
            self.setpoint.fly_to(
                pos_ned,
                yaw,
                cruise_speed=self.cruise_speed,
                climb_speed=self.climb_speed,
                descend_speed=self.descend_speed,
            )

    def stop_point(self) -> Vector:
        """Where the vehicle comes to rest [m] if it brakes now."""
        estimate = self.state.estimate
        north, east, down = estimate.pos_ned
        vel_north, vel_east, vel_down = estimate.vel_ned
        numbers = self._numbers
        limits = self.craft.limits
        jerk = planned_jerk(numbers[limits.jerk])
        speed = hypot(vel_north, vel_east)
        if speed > 0.1:  # below that it is noise
            reach = braking_distance(speed, planned_accel(numbers[limits.accel_hor]), jerk) / speed
            north += vel_north * reach
            east += vel_east * reach
        vertical = limits.vertical
        if vertical is not None and abs(vel_down) > 0.1:
            accel = numbers[vertical.accel_up if vel_down > 0.0 else vertical.accel_down]
            reach = braking_distance(abs(vel_down), accel, jerk)
            down += reach if vel_down > 0.0 else -reach
        return north, east, down

    def height_above_ground(self) -> tuple[float, bool]:
        """Height [m], and whether it is measured by the range finder rather than counted from where it last stood."""
        estimate = self.state.estimate
        if estimate.flags & TERRAIN_VALID:
            return estimate.terrain_d - estimate.pos_ned[2], True
        stand_ned = self.state.stand_ned or self.state.home_ned
        return stand_ned[2] - estimate.pos_ned[2], False

    def heading_to(self, start_ned: Vector, target_ned: Vector, asked: float) -> float:
        """The heading asked for [rad]; NaN: towards the target, or unchanged if that is near."""
        if isfinite(asked):
            return asked
        north = target_ned[0] - start_ned[0]
        east = target_ned[1] - start_ned[1]
        return atan2(east, north) if hypot(north, east) > 1.0 else self.state.yaw_rad

    def hold_next(self, pos_ned: Vector, yaw: float) -> None:
        """Goes over to Hold, at the given position."""
        self.next_hold = (pos_ned, yaw, False)
        self.wish = Mode.HOLD

    def _on_parameter(self, parameter: Parameter) -> None:
        self._numbers[parameter.name] = float(self.params[parameter.name])
        self.yaw_mode = self._yaw_mode()

    def _yaw_mode(self) -> int:
        name = self.craft.yaw_mode_param
        return int(self._numbers[name]) if name else 0


def distance(a: Vector, b: Vector) -> float:
    """Distance between two points [m]."""
    return sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


def braking_distance(speed: float, accel: float, jerk: float) -> float:
    """Distance [m] from a speed to rest with limited acceleration and jerk, starting without acceleration."""
    peak = min(accel, sqrt(speed * jerk))
    return speed * (0.5 * speed / peak + 0.5 * peak / jerk)
