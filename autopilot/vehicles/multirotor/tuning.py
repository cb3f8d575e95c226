"""The gains of the multirotor's cascade, and their margins: what `make tune` designs and prints.

The model is the airframe hovering: torque to body rate is an integrator behind the motors' first-order lag and the
loop's delay; each outer loop sees the closed inner one. Gains are set from the inside out, each loop as fast as the
design margins allow. The disturbance observer subtracts nothing that the model knows of, so it appears only in the
rows "+25 %", where the motors push that much more than modelled.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import control
import numpy as np

from autopilot.control.margins import (
    FAST_DELAY_S,
    GAIN_DESIGN_DB,
    INTEGRATOR,
    SLOW_DELAY_S,
    Design,
    Gains,
    Margins,
    System,
    delay,
    fraction,
    greatest_gain,
    lag,
    low_pass,
    margins_of,
    pi,
    two_digits,
)
from autopilot.vehicles.multirotor.params import CONTROL_PARAMETERS
from common.airframes.multirotor import MultirotorAirframe
from common.params import ParameterTable


def motor_time_s(airframe: MultirotorAirframe) -> float:
    """Mean of the lags of rising and falling speed."""
    return 0.5 * (airframe.rotor_model.spin_up_time_s + airframe.rotor_model.spin_down_time_s)


class Cascade:
    """The open loops of an airframe with given gains, each with the loops inside it closed."""

    def __init__(self, airframe: MultirotorAirframe, gains: Mapping[str, float]) -> None:
        self.gains = gains
        self.actuator = lag(motor_time_s(airframe)) * delay(FAST_DELAY_S)

    def rate(self, axis: str) -> tuple[System, System]:
        """Open rate loop, and closed from rate setpoint to rate; the derivative acts on the measurement only."""
        gains = self.gains
        gyro = low_pass(gains["gyro_cutoff_hz"])
        plant = self.actuator * INTEGRATOR
        forward = pi(gains[f"rate_p_{axis}"], gains[f"rate_i_{axis}"])
        cutoff = gains["gyro_rate_cutoff_hz"] * 2.0 * np.pi
        derivative = fraction([gains[f"rate_d_{axis}"] * cutoff, 0.0], [1.0, cutoff])
        back = (forward + derivative) * gyro
        return plant * back, control.feedback(plant, back) * forward

    def _attitude(self, axis: str) -> tuple[System, System]:
        gain = self.gains["att_p_roll" if axis == "tilt" else "att_p_yaw"]
        loop = gain * self.rate(axis)[1] * INTEGRATOR
        return loop, control.feedback(loop, 1)

    def _acceleration(self, axis: str, thrust: float) -> System:
        """From acceleration setpoint to acceleration, with the disturbance observer, `thrust` times the modelled."""
        inner = self._attitude("tilt")[1] if axis == "xy" else self.actuator
        inner = inner * delay(SLOW_DELAY_S)
        if thrust == 1.0 or self.gains["disturbance_cutoff_hz"] == 0.0:
            return thrust * inner
        seen = (thrust - 1.0) * inner * low_pass(self.gains["disturbance_cutoff_hz"])
        return thrust * inner * control.feedback(control.ss([], [], [], [[1.0]]), seen)

    def _velocity(self, axis: str, thrust: float = 1.0) -> tuple[System, System]:
        gains = self.gains
        inner = self._acceleration(axis, thrust)
        forward = pi(gains[f"vel_p_{axis}"], gains[f"vel_i_{axis}"])
        damping = gains[f"vel_d_{axis}"] * low_pass(gains["accel_cutoff_hz"])
        loop = inner * (forward * INTEGRATOR + damping)
        closed = control.feedback(inner, forward * INTEGRATOR + damping) * forward * INTEGRATOR
        return loop, closed

    def _position(self, axis: str, thrust: float = 1.0) -> System:
        return self.gains[f"pos_p_{axis}"] * self._velocity(axis, thrust)[1] * INTEGRATOR

    def loops(self) -> dict[str, Callable[[], System]]:
        """Open loops by name, from the inside out."""
        return {
            "rate roll/pitch": lambda: self.rate("tilt")[0],
            "rate yaw": lambda: self.rate("yaw")[0],
            "attitude roll/pitch": lambda: self._attitude("tilt")[0],
            "attitude yaw": lambda: self._attitude("yaw")[0],
            "velocity xy": lambda: self._velocity("xy")[0],
            "velocity z": lambda: self._velocity("z")[0],
            "velocity xy +25 %": lambda: self._velocity("xy", 1.25)[0],
            "velocity z +25 %": lambda: self._velocity("z", 1.25)[0],
            "position xy": lambda: self._position("xy"),
            "position z": lambda: self._position("z"),
        }

    def margins(self, loop: str) -> Margins:
        """Gain, phase and disk margins of one loop."""
        return margins_of(loop, self.loops()[loop]())


def default_gains() -> Gains:
    """The declared defaults in SI."""
    return ParameterTable(CONTROL_PARAMETERS).fields(CONTROL_PARAMETERS)


def all_margins(airframe: MultirotorAirframe, gains: Mapping[str, float] | None = None) -> list[Margins]:
    """Margins of every loop with the given gains, or the defaults."""
    cascade = Cascade(airframe, default_gains() if gains is None else gains)
    return [cascade.margins(loop) for loop in cascade.loops()]


@dataclass(frozen=True, slots=True)
class Rule:
    """How one loop is designed: the greatest gain with this phase margin, its other gains in proportion to it."""

    loop: str
    gain: str
    phase_deg: float
    integral_per_s: float = 0.0
    derivative_s: float = 0.0
    derivative_lags: float = 0.0
    """Derivative over proportional gain, in motor lags: 1 would cancel the lag."""


# Phase margins above the required ones, so that slower motors and other loads stay within those. Inner loops get
# more, since every loop round them builds on theirs.
RULES = [
    Rule("rate roll/pitch", "rate_p_tilt", 66.0, integral_per_s=2.5, derivative_lags=0.7),
    Rule("rate yaw", "rate_p_yaw", 69.0, integral_per_s=1.0),
    Rule("attitude roll/pitch", "att_p_roll", 64.0),
    Rule("attitude yaw", "att_p_yaw", 72.0),
    Rule("velocity xy", "vel_p_xy", 63.0, integral_per_s=0.33, derivative_s=0.025),
    Rule("velocity z", "vel_p_z", 75.0, integral_per_s=0.33),
    Rule("position xy", "pos_p_xy", 57.0),
    Rule("position z", "pos_p_z", 67.0),
]


def design(airframe: MultirotorAirframe) -> Gains:
    """Gains for an airframe, from the inside out; what no rule names keeps its default."""
    gains = default_gains()
    for rule in RULES:
        stem, _, axis = rule.gain.partition("_p_")
        unit = {rule.gain: 1.0}
        if f"{stem}_i_{axis}" in gains:
            unit[f"{stem}_i_{axis}"] = rule.integral_per_s
            unit[f"{stem}_d_{axis}"] = rule.derivative_s + rule.derivative_lags * motor_time_s(airframe)
        if rule.gain == "att_p_roll":
            unit["att_p_pitch"] = 1.0
        loop = Cascade(airframe, {**gains, **unit}).loops()[rule.loop]()
        factor = greatest_gain(loop, rule.phase_deg, GAIN_DESIGN_DB)
        gains.update({name: two_digits(factor * value) for name, value in unit.items()})
    return gains


def judge(airframe: MultirotorAirframe) -> Design:
    """Margins of the default gains, and the gains that the rules give."""
    return Design(all_margins(airframe), design(airframe))
