"""The plane as a class of vehicles."""

from collections.abc import Sequence

from autopilot.estimator.airspeed_params import AIRSPEED_PARAMETERS
from autopilot.interface.outputs import Output, OutputKind
from autopilot.interface.vehicle_state import Mode, VehicleState
from autopilot.ports import AIRSPEED_VALID
from autopilot.vehicles.plane.ardupilot import APM_PLANE
from autopilot.vehicles.plane.defaults import plane_defaults
from autopilot.vehicles.plane.landing_detector import PlaneLandingDetector
from autopilot.vehicles.plane.law import PLANE_LAW
from autopilot.vehicles.plane.modes.legs import PlaneLeg
from autopilot.vehicles.plane.modes.params import MODE_PARAMETERS
from autopilot.vehicles.plane.modes.table import PLANE_MODES
from autopilot.vehicles.plane.params import PLANE_PARAMETERS
from autopilot.vehicles.vehicle_class import GroundHandling, MotionLimits, VehicleClass, VerticalLimits
from common.airframes.plane import PlaneAirframe
from common.params import ParameterTable

_MAV_TYPE_FIXED_WING = 1
_MOTOR = 2  # among the outputs
_CARRYING_THROTTLE = 0.4  # guess: with less it does not leave the ground


def _outputs(_: PlaneAirframe) -> Sequence[Output]:
    def servo(name: str) -> Output:
        return Output(name, OutputKind.SERVO, is_signed=True)

    return (
        servo("ailerons"),
        servo("elevator"),
        Output("motor", OutputKind.MOTOR),
        servo("rudder"),
        servo("nose wheel"),
        Output("brake", OutputKind.SERVO),
    )


def _standing_height_m(airframe: PlaneAirframe) -> float:
    return airframe.standing_height_m


def _measures_airspeed(state: VehicleState, _: ParameterTable) -> str:
    return "" if state.estimate.flags & AIRSPEED_VALID else "no airspeed is measured"


PLANE = VehicleClass(
    name="plane",
    law=PLANE_LAW,
    parameters=(*PLANE_PARAMETERS, *MODE_PARAMETERS, *AIRSPEED_PARAMETERS),
    defaults=plane_defaults,
    modes=PLANE_MODES,
    last_resort=Mode.HOLD,
    limits=MotionLimits(
        cruise_speed="FW_AIRSPD_TRIM",
        speed_max="FW_AIRSPD_MAX",
        accel_hor="HG_FW_ACC",
        accel_across="HG_FW_ACC",
        jerk="HG_FW_JERK",
        jerk_auto="HG_FW_JERK",
        vertical=VerticalLimits(
            climb_speed="FW_T_CLMB_R_SP",
            descend_speed="FW_T_SINK_R_SP",
            climb_max="FW_T_CLMB_MAX",
            descend_max="FW_T_SINK_MAX",
            accel_up="FW_T_VERT_ACC",
            accel_down="FW_T_VERT_ACC",
            alt_radius="NAV_FW_ALT_RAD",
        ),
        path_error="HG_FW_ERR",
        yaw_rate="FW_Y_RMAX",
    ),
    mav_type=lambda _: _MAV_TYPE_FIXED_WING,
    ardupilot=APM_PLANE,
    outputs=_outputs,
    motors=lambda _: (_MOTOR,),
    standing_height_m=_standing_height_m,
    ground=GroundHandling(
        detector=lambda params, _: PlaneLandingDetector(params),
        lift_thrust=lambda _: _CARRYING_THROTTLE,
        takeoff_speed="FW_T_CLMB_R_SP",
        land_speed="FW_LND_FL_SINK",
        crawl_speed="FW_LND_FL_SINK",
        slowing_height="FW_LND_FLALT",
        slow_height="FW_LND_FLALT",
        crawl_height="FW_LND_FLALT",
        settles=False,
    ),
    leg=PlaneLeg,
    arming_checks=(_measures_airspeed,),
)
