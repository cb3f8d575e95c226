"""The multirotor as a class of vehicles."""

from autopilot.interface.vehicle_state import Mode
from autopilot.vehicles.multirotor.defaults import airframe_defaults, hover_thrust
from autopilot.vehicles.multirotor.landing_detector import LandingDetector
from autopilot.vehicles.multirotor.law import MULTIROTOR_LAW
from autopilot.vehicles.multirotor.modes import MULTIROTOR_MODES
from autopilot.vehicles.multirotor.params import CONTROL_PARAMETERS
from autopilot.vehicles.vehicle_class import VehicleClass
from common.airframe import Airframe
from common.params import ParameterTable

_MAV_TYPES = {3: 15, 4: 2, 6: 13, 8: 14}  # MAV_TYPE_TRICOPTER, _QUADROTOR, _HEXAROTOR, _OCTOROTOR
_MAV_TYPE_QUADROTOR = 2


def _landing_detector(params: ParameterTable, airframe: Airframe) -> LandingDetector:
    return LandingDetector(params, hover_thrust(airframe), airframe.contact.leg_z_m)


def _mav_type(airframe: Airframe) -> int:
    return _MAV_TYPES.get(len(airframe.rotors), _MAV_TYPE_QUADROTOR)


MULTIROTOR = VehicleClass(
    name="multirotor",
    law=MULTIROTOR_LAW,
    parameters=CONTROL_PARAMETERS,
    defaults=airframe_defaults,
    ground_detector=_landing_detector,
    modes=MULTIROTOR_MODES,
    last_resort=Mode.LAND,
    hover_thrust=hover_thrust,
    mav_type=_mav_type,
)
