"""The gains of a rover's loops, and their margins at several speeds: what `make tune` designs and prints.

The throttle asks the motor for a speed, which the vehicle takes up with the motor's lag. The steering asks for a yaw
rate through the inverse of the geometry; the servo's lag stands between, and the linear bicycle with side forces in
proportion to slip, behind the tyres' relaxation (H. B. Pacejka, "Tire and Vehicle Dynamics", 2012, section 1.3). With
skid steer the sides take up their difference as the vehicle does its speed. Each outer loop sees the closed inner one.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import control
import numpy as np

from autopilot.control.margins import (
    FAST_DELAY_S,
    INTEGRATOR,
    SLOW_DELAY_S,
    Design,
    Gains,
    Margins,
    System,
    delay,
    greatest_gain,
    lag,
    low_pass,
    margins_of,
    pi,
    two_digits,
)
from autopilot.vehicles.rover.cascade import YAW_RATE_CUTOFF_HZ
from autopilot.vehicles.rover.control_airframe import motor_time_s
from autopilot.vehicles.rover.defaults import rover_defaults
from autopilot.vehicles.rover.params import ROVER_PARAMETERS
from common.airframes.rover import RoverAirframe
from common.geodesy import GRAVITY_M_S2
from common.params import ParameterTable

SPEEDS_M_S = (0.5, 2.0, 5.0)


def speeds(airframe: RoverAirframe) -> list[float]:
    """Speeds [m/s] at which the loops are looked at: up to the airframe's own limit."""
    fastest = float(rover_defaults(airframe)["RO_SPEED_LIM"])
    return [speed for speed in SPEEDS_M_S if speed < fastest] + [fastest]


def default_gains(airframe: RoverAirframe) -> Gains:
    """The declared defaults in SI, and those that the airframe decides."""
    table = ParameterTable(ROVER_PARAMETERS)
    for name, value in rover_defaults(airframe).items():
        if name in table:
            table.set(name, value)
    return table.fields(ROVER_PARAMETERS)


class Loops:
    """The open loops of an airframe at a speed [m/s] with given gains, each with the loops inside it closed."""

    def __init__(self, airframe: RoverAirframe, gains: Mapping[str, float], speed: float) -> None:
        self.airframe, self.gains, self.at = airframe, gains, speed
        self.waiting = delay(FAST_DELAY_S + SLOW_DELAY_S)
        self.motor = lag(airframe.drive.lag_s) * lag(motor_time_s(airframe))

    def speed(self) -> System:
        return pi(self.gains["speed_p"], self.gains["speed_i"]) * self.motor * self.waiting

    def _turning(self) -> System:
        """From the yaw rate that the steering is asked for to the yaw rate."""
        if self.airframe.is_skid:
            return self.motor * self.waiting * (1.0 / self.gains["yaw_rate_correction"])
        body, wheels, tyres = self.airframe.body, self.airframe.wheels, self.airframe.tyres
        front, rear, base = wheels.front_x_m, wheels.rear_x_m, self.airframe.wheel_base_m
        per_slip = 2.0 * tyres.friction / tyres.peak_slip * body.mass_kg * GRAVITY_M_S2  # the parabola's slope, 1/rad
        stiff_front, stiff_rear = per_slip * rear / base, per_slip * front / base
        mass, moment, speed = body.mass_kg, body.inertia_zz_kg_m2, self.at
        moved = stiff_front * front - stiff_rear * rear
        matrix = [
            [-(stiff_front + stiff_rear) / (mass * speed), -moved / (mass * speed) - speed],
            [-moved / (moment * speed), -(stiff_front * front**2 + stiff_rear * rear**2) / (moment * speed)],
        ]
        bicycle = control.ss(matrix, [[stiff_front / mass], [stiff_front * front / moment]], [[0.0, 1.0]], [[0.0]])
        servo = lag(self.airframe.steering.lag_s) * lag(tyres.relaxation_m / speed)
        return servo * bicycle * self.waiting * (base / speed)

    def yaw_rate(self) -> tuple[System, System]:
        """Open, and closed from the yaw rate asked for to the yaw rate."""
        gains, plant = self.gains, self._turning()
        back = pi(gains["yaw_rate_p"], gains["yaw_rate_i"])
        seen = back * low_pass(float(YAW_RATE_CUTOFF_HZ))
        forward = control.ss([], [], [], [[gains["yaw_rate_correction"]]]) + back
        return plant * seen, control.feedback(plant, seen) * forward

    def course(self) -> System:
        return self.gains["yaw_p"] * self.yaw_rate()[1] * INTEGRATOR

    def cross_track(self) -> System:
        """With the turning of the course fed forward."""
        gains = self.gains
        reach = float(np.clip(gains["lookahead_s"] * self.at, gains["lookahead_min"], gains["lookahead_max"]))
        inner, gain = self.yaw_rate()[1], gains["yaw_p"]
        by_error = control.feedback(gain * inner * INTEGRATOR, 1.0)
        by_rate = control.feedback(inner, gain * INTEGRATOR)
        return (self.at / reach) * INTEGRATOR * (by_error + by_rate)

    def loops(self) -> dict[str, Callable[[], System]]:
        """Open loops by name, from the inside out."""
        return {
            "speed": self.speed,
            "yaw rate": lambda: self.yaw_rate()[0],
            "course": self.course,
            "cross-track": self.cross_track,
        }


def all_margins(airframe: RoverAirframe, gains: Mapping[str, float] | None = None) -> list[Margins]:
    """Margins of every loop at every speed, with the given gains or the defaults."""
    found = []
    for speed in speeds(airframe):
        loops = Loops(airframe, default_gains(airframe) if gains is None else gains, speed).loops()
        found += [margins_of(f"{name} at {speed:g} m/s", loop()) for name, loop in loops.items()]
    return found


@dataclass(frozen=True, slots=True)
class Rule:
    """How one loop is designed: the greatest gain with these margins at all speeds, its integral in proportion."""

    loop: str
    gain: str
    gain_db: float
    integral: str = ""
    integral_per_s: float = 0.0


PHASE_DESIGN_DEG = 65.0
# Far more than the required margins: the feed-forward drives, and throttle and steering shall not follow noise.
RULES = [
    Rule("speed", "speed_p", 18.0, "speed_i", 1.5),
    Rule("yaw rate", "yaw_rate_p", 14.5, "yaw_rate_i", 4.0),
    Rule("course", "yaw_p", 14.5),
]


def design(airframe: RoverAirframe) -> Gains:
    """Gains for an airframe, from the inside out; what no rule names keeps its default."""
    gains = default_gains(airframe)
    for rule in RULES:
        unit = {rule.gain: 1.0}
        if rule.integral:
            unit[rule.integral] = rule.integral_per_s
        factor = min(
            greatest_gain(
                Loops(airframe, {**gains, **unit}, speed).loops()[rule.loop](), PHASE_DESIGN_DEG, rule.gain_db
            )
            for speed in speeds(airframe)
        )
        gains.update({name: two_digits(factor * value) for name, value in unit.items()})
    return gains


def judge(airframe: RoverAirframe) -> Design:
    """Margins of the default gains, and the gains that the rules give."""
    return Design(all_margins(airframe), design(airframe))
