"""Failures that clients ask for, made in the simulator: sensors, battery, motors.

In: requests of the flight controller (autopilot.interface.failure_requests). Out: rows of the simulator's faults. What
an intermittent part does in between is renewed each frame; nothing else costs anything.

| unit     | off    | stuck | garbage    | wrong        | slow       | intermittent |
|----------|--------|-------|------------|--------------|------------|--------------|
| sensors  | silent | yes   | noise x 30 | see `WRONG`  | period x 5 | off and on   |
| battery  | empty  | yes   | noise x 30 | see `WRONG`  | period x 5 | -            |
| motor    | stops  | -     | -          | -            | 60 %       | off and on   |

Nothing can be delayed.
"""

from typing import Any

from autopilot.estimator.sensors import FUSED_SENSORS
from autopilot.interface.failure_requests import Failure, Unit
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from common.airframe import Airframe
from sim.battery import battery_model, charge_at
from sim.faults import set_fault, set_motor_loss
from sim.rig import Rig

SENSORS = {
    Unit.GYRO: "gyro",
    Unit.ACCELEROMETER: "accel",
    **{Unit(sensor.failure_unit): sensor.name for sensor in FUSED_SENSORS if sensor.failure_unit is not None},
    Unit.AIRSPEED: "airspeed",
    Unit.BATTERY: "battery",
}
WRONG = {
    "gyro": 0.3,  # rad/s
    "accel": 2.0,  # m/s²
    **{sensor.name: sensor.wrong_bias for sensor in FUSED_SENSORS},
    "airspeed": -150.0,  # Pa
    "battery": -1.5,  # V
}
"""By how much a wrong sensor is wrong, on each axis; guesses: far beyond any gate."""
GARBAGE_FACTOR = 30.0
SLOW_FACTOR = 5.0
WEAK_LOSS = 0.4  # share of its command that a slow motor loses: ArduPilot's weak motor runs at 60 %
EMPTY_FRACTION = 0.04  # of the charge that an empty battery has left: below BAT_EMERGEN_THR
INTERMITTENT_US = 1_000_000  # off for so long, then on for so long


class RigInjector:
    """Breaks one vehicle of a rig.

    Args:
        rig: the simulator.
        airframe: of the vehicle.
        noise: scale of its sensors' noise; without noise there is none to amplify.
        motor_count: of the vehicle.
        i_vehicle: which row.
    """

    def __init__(self, rig: Rig, airframe: Airframe, noise: float, motor_count: int, i_vehicle: int = 0) -> None:
        self._faults = rig.rows["faults"][i_vehicle]
        body = rig.rows["body"][i_vehicle : i_vehicle + 1]
        self._charge: Any = body["battery_charge_c"] if "battery_charge_c" in body.dtype.names else None  # [C]
        self._has_pitot = bool(rig.rows["truth"][i_vehicle]["has_pitot"])
        self._battery = battery_model(airframe)
        self._capacity_c = 3.6 * airframe.battery.capacity_mah
        self._motor_count = motor_count
        self._has_noise = noise > 0.0
        self._taken_c = 0.0  # charge that an injected failure has taken from the battery
        self.failures: set[tuple[Unit, int]] = set()  # parts that fail now, as somebody asked for
        self._intermittent: dict[tuple[Unit, int], bool] = {}  # part: whether it is off now
        self._toggled_us = 0

    def inject(self, unit: Unit, failure: Failure, instance: int) -> Reply:
        """See autopilot.interface.failure_requests.FailureInjector."""
        if unit is Unit.MOTOR:
            if not 0 <= instance <= self._motor_count:
                return Reply(Verdict.DENIED, f"there are motors 1 to {self._motor_count}")
            motors = range(self._motor_count) if instance == 0 else (instance - 1,)
            replies = [self._inject_motor(motor, failure) for motor in motors]
            return replies[0]
        if unit not in SENSORS or (unit is Unit.AIRSPEED and not self._has_pitot):
            return Reply(Verdict.UNSUPPORTED, f"there is no {unit.name.lower().replace('_', ' ')} that could fail")
        if instance not in (0, 1):
            return Reply(Verdict.DENIED, "there is only one of it")
        if unit is Unit.BATTERY and failure is Failure.OFF and self._charge is None:
            return Reply(Verdict.UNSUPPORTED, "the battery has no charge that could be taken")
        return self._inject_sensor(unit, SENSORS[unit], failure)

    def frame(self, time_us: int) -> None:
        """Lets intermittent parts come and go."""
        if not self._intermittent or time_us - self._toggled_us < INTERMITTENT_US:
            return
        self._toggled_us = time_us
        for (unit, motor), is_off in list(self._intermittent.items()):
            self._intermittent[unit, motor] = not is_off
            if unit is Unit.MOTOR:
                set_motor_loss(self._faults, motor, 0.0 if is_off else 1.0)
            else:
                set_fault(self._faults, SENSORS[unit], "none" if is_off else "off")

    def _inject_motor(self, motor: int, failure: Failure) -> Reply:
        losses = {Failure.OK: 0.0, Failure.OFF: 1.0, Failure.SLOW: WEAK_LOSS, Failure.INTERMITTENT: 1.0}
        if failure not in losses:
            return _impossible("a motor", failure)
        set_motor_loss(self._faults, motor, losses[failure])
        self._note(Unit.MOTOR, motor, failure)
        return ACCEPTED

    def _inject_sensor(self, unit: Unit, sensor: str, failure: Failure) -> Reply:
        changes: dict[Failure, tuple[str, float]] = {
            Failure.OK: ("none", 0.0),
            Failure.OFF: ("off", 0.0),
            Failure.STUCK: ("stuck", 0.0),
            Failure.GARBAGE: ("noisy", GARBAGE_FACTOR),
            Failure.WRONG: ("biased", WRONG[sensor]),
            Failure.SLOW: ("slow", SLOW_FACTOR),
            Failure.INTERMITTENT: ("off", 0.0),
        }
        if failure not in changes or (unit is Unit.BATTERY and failure is Failure.INTERMITTENT):
            return _impossible("it", failure)
        if failure is Failure.GARBAGE and not self._has_noise:
            return Reply(Verdict.UNSUPPORTED, "the sensors have no noise to amplify")
        if unit is Unit.BATTERY and failure in (Failure.OK, Failure.OFF):
            self._set_empty(failure is Failure.OFF)
            set_fault(self._faults, sensor, "none")
        else:
            set_fault(self._faults, sensor, *changes[failure])
        self._note(unit, 0, failure)
        return ACCEPTED

    def weaken(self, motor: int, fraction: float) -> None:
        """Gives a motor, from 0, a share of its command only."""
        set_motor_loss(self._faults, motor, 1.0 - fraction)
        self._note(Unit.MOTOR, motor, Failure.OK if fraction == 1.0 else Failure.SLOW)

    def repair(self) -> None:
        """Ends every failure that was asked for."""
        for unit, motor in sorted(self.failures):
            self.inject(unit, Failure.OK, motor + 1 if unit is Unit.MOTOR else 0)

    def charge_to(self, rest_v: float) -> None:
        """Gives the battery the charge at which it rests at a voltage; of a body without one nothing changes."""
        if self._charge is not None:
            self._charge[0] = charge_at(self._battery, rest_v)

    def _note(self, unit: Unit, motor: int, failure: Failure) -> None:
        if failure is Failure.OK:
            self.failures.discard((unit, motor))
        else:
            self.failures.add((unit, motor))
        if failure is Failure.INTERMITTENT:
            self._intermittent[unit, motor] = True
        else:
            self._intermittent.pop((unit, motor), None)

    def _set_empty(self, is_empty: bool) -> None:
        """Takes the charge out of the battery, or gives back what was taken."""
        charge = self._charge
        if charge is None:
            return
        if is_empty:
            left_c = EMPTY_FRACTION * self._capacity_c
            taken_c = max(float(charge[0]) - left_c, 0.0)
            self._taken_c += taken_c
            charge[0] -= taken_c
        else:
            charge[0] += self._taken_c
            self._taken_c = 0.0


def _impossible(what: str, failure: Failure) -> Reply:
    return Reply(Verdict.UNSUPPORTED, f"{what} cannot be made {failure.name.lower()}")
