"""A second class of vehicles, as its folders would have it: a sled that drives along its nose, always on the ground.

Its body and its control law are those of tests/unit/sim/sled.py. Here is what the Python part must know of it.
"""

from math import cos, degrees, hypot, sin

from autopilot.interface.ardupilot_vehicle import Alias, ArduPilotVehicle
from autopilot.interface.client_requests import GoTo, OffboardSetpoint
from autopilot.interface.failsafe_action import Action
from autopilot.interface.mode_spec import (
    OFFBOARD_OVERRIDE,
    DialectMode,
    Disarmed,
    FlightMode,
    ModeSpec,
    Px4Main,
    further_mode,
    mode_table,
    px4_mode,
)
from autopilot.interface.outputs import Output, OutputKind
from autopilot.interface.vehicle_state import ACCEPTED, Mode
from autopilot.navigator.mode_parts import of_context
from autopilot.navigator.modes.offboard import Offboard
from autopilot.vehicles.vehicle_class import MotionLimits, VehicleClass
from common.params import Parameter
from sim.bodies.vehicles import SimulatedClass
from tests.unit.sim.sled import SLED_BODY, SLED_LAW, SLED_PARAMETERS

MAV_TYPE_GROUND_ROVER = 10
MAV_PARAM_TYPE_REAL32 = 9
DRIVE = further_mode(100, "DRIVE")
PARAMETERS = (
    *SLED_PARAMETERS,
    Parameter("SLED_SPEED", 2.0, 0.1, 10.0, "m/s", "speed to a place", "guess"),
    Parameter("SLED_ACCEL", 1.0, 0.1, 10.0, "m/s2", "acceleration", "guess"),
    Parameter("SLED_JERK", 5.0, 0.1, 50.0, "m/s3", "change of acceleration", "guess"),
    Parameter("SLED_LAG", 2.0, 0.1, 10.0, "m", "by which it may lag behind", "guess"),
    Parameter("SLED_YAW_RATE", 10.0, 0.1, 90.0, "deg/s", "turning rate", "guess"),
    Parameter("SLED_SLOPE", 15.0, -1.0, 45.0, "deg", "steepest slope on which it is armed", "guess"),
)


class Stop(FlightMode):
    """Mode Hold: stands still."""

    def __init__(self, context):
        self._context = context

    def frame(self):
        self._context.setpoint.move((0.0, 0.0, 0.0), 0.0)


class Drive(FlightMode):
    """Mode Drive: along the nose until it is beside the place that it was sent to."""

    def __init__(self, context):
        self._context = context
        self._place = None
        self._next = None

    def take(self, request):
        self._next = self._context.pos_ned_of(request.lat_deg, request.lon_deg, self._context.state.position.alt_m)
        return ACCEPTED

    def forget(self):
        self._next = None

    def start(self):
        self._place, self._next = self._next, None

    def frame(self):
        context = self._context
        north, east = cos(context.state.yaw_rad), sin(context.state.yaw_rad)
        speed = 0.0
        if self._place is not None:
            here, limit = context.state.estimate.pos_ned, context.number("SLED_SPEED")
            ahead_m = north * (self._place[0] - here[0]) + east * (self._place[1] - here[1])
            speed = min(max(0.5 * ahead_m, -limit), limit)
        context.setpoint.move((speed * north, speed * east, 0.0), 0.0)


def stands_level(state, params):
    slope_deg = degrees(hypot(state.roll_rad, state.pitch_rad))
    return f"the slope of {slope_deg:.0f} degrees is too steep" if slope_deg > params["SLED_SLOPE"] else ""


ROVER = ArduPilotVehicle("Rover", (4, 6, 3), aliases=(Alias("CRUISE_SPEED", "SLED_SPEED", MAV_PARAM_TYPE_REAL32),))
SLED = VehicleClass(
    name="sled",
    law=SLED_LAW,
    parameters=PARAMETERS,
    defaults=lambda airframe: {
        "BAT1_N_CELLS": airframe.battery.cells,
        "SLED_SPEED": airframe.runners.speed_m_s,
    },
    modes=mode_table(
        ModeSpec(
            mode=Mode.HOLD,
            build=of_context(Stop),
            may_arm=True,
            on_ground=True,
            px4=px4_mode(Px4Main.AUTO, 3, "Hold"),
            ardupilot=DialectMode(4, "Hold"),
            nav_state=4,
            carries_out=(Action.HOLD,),
        ),
        ModeSpec(
            mode=DRIVE,
            build=of_context(Drive),
            needs_position=True,
            on_ground=True,
            disarmed=Disarmed.HOLD,
            takes=(GoTo,),
            px4=px4_mode(Px4Main.AUTO, 11, "Drive"),
            ardupilot=DialectMode(15, "Guided"),
            nav_state=23,
        ),
        ModeSpec(
            mode=Mode.OFFBOARD,
            build=of_context(Offboard),
            needs_position=True,
            on_ground=True,
            disarmed=Disarmed.HOLD,
            takes=(OffboardSetpoint,),
            px4=px4_mode(Px4Main.OFFBOARD, 0, "Offboard"),
            ardupilot=DRIVE,
            nav_state=14,
            override=OFFBOARD_OVERRIDE,
        ),
    ),
    last_resort=Mode.HOLD,
    limits=MotionLimits(
        cruise_speed="SLED_SPEED",
        speed_max="SLED_SPEED",
        accel_hor="SLED_ACCEL",
        jerk="SLED_JERK",
        jerk_auto="SLED_JERK",
        path_error="SLED_LAG",
        yaw_rate="SLED_YAW_RATE",
    ),
    mav_type=lambda _: MAV_TYPE_GROUND_ROVER,
    ardupilot=ArduPilotVehicle(
        "Rover", (4, 6, 3), aliases=(Alias("CRUISE_SPEED", "SLED_SPEED", MAV_PARAM_TYPE_REAL32),)
    ),
    outputs=lambda _: (Output("pusher", OutputKind.MOTOR, is_signed=True),),
    motors=lambda _: (0,),
    arming_checks=(stands_level,),
    standing_height_m=lambda _: 0.1,
)
SIMULATED_SLED = SimulatedClass(SLED, SLED_BODY)
