"""The simulator's parameters, under ArduPilot's names: wind, failures, pace. They are there in its dialect alone.

In: changes by clients. Out: what they say is done to the flight's air, body, sensors and pace from the next frame on.
They are those of one flight: none is kept for the next.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from autopilot.interface.failure_requests import Failure, Unit
from autopilot.interface.vehicle_state import Reply
from common.airframe import Airframe
from common.geodesy import GeoPoint
from common.params import Parameter, ParameterTable

if TYPE_CHECKING:
    from autopilot.flight_controller import FlightController

PREFIX = "SIM_"
SPEEDUP = "SIM_SPEEDUP"
TURBULENCE_FRACTION = 0.1  # of the mean wind: MIL-F-8785C's vertical deviation
_OURS = "the flight's options"
_ARDUPILOT = "ArduPilot default"


def simulator_parameters(airframe: Airframe, home: GeoPoint, wind_m_s: float, wind_from_deg: float) -> list[Parameter]:
    """The declarations; the defaults are what the flight is made from."""
    battery = airframe.battery
    turbulence = TURBULENCE_FRACTION * wind_m_s
    full_v, empty_v = (battery.cells * volts for volts in (battery.full_cell_v, battery.empty_cell_v))
    return [
        Parameter(SPEEDUP, 1.0, 0.0, 1000.0, "", "simulated seconds per second, 0: as fast as possible", _OURS),
        Parameter("SIM_WIND_SPD", wind_m_s, 0.0, 20.0, "m/s", "mean wind", _OURS),
        Parameter("SIM_WIND_DIR", wind_from_deg, 0.0, 360.0, "deg", "where the wind comes from", _OURS),
        Parameter("SIM_WIND_TURB", turbulence, 0.0, 5.0, "m/s",
                  "turbulence: deviation of the vertical wind; gusts are up to three times that", _OURS),
        Parameter("SIM_GPS1_ENABLE", 1, 0, 1, "", "0: the GNSS receiver falls silent", _ARDUPILOT),
        Parameter("SIM_BARO_DISABLE", 0, 0, 1, "", "1: the barometer falls silent", _ARDUPILOT),
        Parameter("SIM_MAG1_FAIL", 0, 0, 1, "", "1: the magnetometer falls silent", _ARDUPILOT),
        Parameter("SIM_ENGINE_FAIL", 0, 0, 255, "",
                  "motors that SIM_ENGINE_MUL weakens, as bits: 1 motor 1, 2 motor 2, 4 motor 3", _ARDUPILOT),
        Parameter("SIM_ENGINE_MUL", 1.0, 0.0, 1.0, "", "share of its command that such a motor gets", _ARDUPILOT),
        Parameter("SIM_BATT_VOLTAGE", full_v, empty_v, full_v, "V",
                  "set: the battery has the charge at which it rests at this voltage", "airframe file"),
        Parameter("SIM_RC_FAIL", 0, 0, 1, "", "1: the sticks are heard no more", _ARDUPILOT),
        *(
            Parameter(f"SIM_OPOS_{name}", value, value, value, unit, "where the vehicle boots; constant", _OURS)
            for name, value, unit in (
                ("LAT", home.lat_deg, "deg"), ("LNG", home.lon_deg, "deg"), ("ALT", home.alt_m, "m"),
                ("HDG", 0.0, "deg"),
            )
        ),
        Parameter("SIM_RATE_HZ", 250, 250, 250, "Hz", "rate of the simulation; constant", "sim/advance.py"),
    ]  # fmt: skip


class Injector(Protocol):
    """What breaks and repairs the simulated parts (mission.simulator.failure_injection)."""

    def inject(self, unit: Unit, failure: Failure, instance: int) -> Reply: ...

    def weaken(self, motor: int, fraction: float) -> None: ...

    def charge_to(self, rest_v: float) -> None: ...


class SimulatedFlight(Protocol):
    """What the parameters act on (mission.flight)."""

    params: ParameterTable
    controller: "FlightController"

    @property
    def injector(self) -> Injector: ...

    def change_speed(self, speed: float | None) -> None: ...

    def set_air(self, speed_m_s: float, from_deg: float, turbulence_m_s: float) -> None: ...

    def cut_sticks(self, *, is_cut: bool) -> None: ...


class SimulatorParameters:
    """Does what the simulator's parameters say.

    Args:
        flight: whose; its parameters are followed from now on.
    """

    def __init__(self, flight: SimulatedFlight) -> None:
        self._flight = flight
        self._is_reported = False  # by the flight itself: it has been done already
        self._actions: dict[str, Callable[[], None]] = {
            SPEEDUP: self._change_pace,
            "SIM_WIND_SPD": self._blow,
            "SIM_WIND_DIR": self._blow,
            "SIM_WIND_TURB": self._blow,
            "SIM_GPS1_ENABLE": lambda: self._silence(Unit.GNSS, "SIM_GPS1_ENABLE", off_value=0),
            "SIM_BARO_DISABLE": lambda: self._silence(Unit.BAROMETER, "SIM_BARO_DISABLE", off_value=1),
            "SIM_MAG1_FAIL": lambda: self._silence(Unit.MAGNETOMETER, "SIM_MAG1_FAIL", off_value=1),
            "SIM_ENGINE_FAIL": self._weaken,
            "SIM_ENGINE_MUL": self._weaken,
            "SIM_BATT_VOLTAGE": self._charge,
            "SIM_RC_FAIL": self._cut_sticks,
        }
        params = flight.params
        for name, action in self._actions.items():
            if name != SPEEDUP and name in params and params[name] != params.declarations[name].default:
                action()
        params.on_change(self._changed)

    def tell(self, **values: float) -> None:
        """Shows what the flight has done by itself; parameters that it does not have are left out."""
        params = self._flight.params
        self._is_reported = True
        for name, value in values.items():
            if name in params:
                params.set(name, value)
        self._is_reported = False

    def _changed(self, declaration: Parameter) -> None:
        action = self._actions.get(declaration.name)
        if action is not None and not self._is_reported:
            action()

    def _value(self, name: str) -> float:
        return float(self._flight.params[name])

    def _change_pace(self) -> None:
        self._flight.change_speed(self._value(SPEEDUP) or None)

    def _blow(self) -> None:
        speed, direction, turbulence = (self._value(f"SIM_WIND_{name}") for name in ("SPD", "DIR", "TURB"))
        self._flight.set_air(speed, direction, turbulence)

    def _silence(self, unit: Unit, name: str, *, off_value: int) -> None:
        is_off = int(self._value(name)) == off_value
        self._flight.injector.inject(unit, Failure.OFF if is_off else Failure.OK, 1)

    def _weaken(self) -> None:
        weak, fraction = int(self._value("SIM_ENGINE_FAIL")), self._value("SIM_ENGINE_MUL")
        for motor in range(self._flight.controller.state.motor_count):
            self._flight.injector.weaken(motor, fraction if weak >> motor & 1 else 1.0)

    def _charge(self) -> None:
        self._flight.injector.charge_to(self._value("SIM_BATT_VOLTAGE"))

    def _cut_sticks(self) -> None:
        self._flight.cut_sticks(is_cut=bool(self._value("SIM_RC_FAIL")))
