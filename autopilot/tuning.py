"""Designs the gains of the cascade and prints their margins: `python -m autopilot.tuning [--airframe NAME]`.

The model is the airframe hovering: torque to body rate is an integrator behind the motors' first-order lag and the
loop's delay; each outer loop sees the closed inner one. Gains are set from the inside out, each loop as fast as the
design margins allow. The disturbance observer subtracts nothing that the model knows of, so it appears only in the
rows "+25 %", where the motors push that much more than modelled.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import control
import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from autopilot.vehicles.multirotor.params import CONTROL_PARAMETERS
from common.airframe import AirframeError, load_airframe
from common.airframes.multirotor import MultirotorAirframe
from common.kernels import FRAME_TICKS, TICK_S
from common.params import ParameterTable

PHASE_REQUIRED_DEG = 45.0
GAIN_REQUIRED_DB = 6.0
GAIN_DESIGN_DB = 8.0
"""Room above what is required for airframes and batteries that differ from their file."""

FAST_DELAY_S = 1.5 * TICK_S
"""IMU averaging (half a tick), holding the command (half), and half a tick for transport and computing."""
SLOW_DELAY_S = 0.5 * FRAME_TICKS * TICK_S
"""Holding the outer loops' output between 50 Hz frames."""
PADE_ORDER = 3
OMEGA = np.logspace(-2, 3, 1200)  # [rad/s]

Gains = dict[str, float]
"""Fields of ControlParams and their values in SI."""
System = Any
"""A python-control state-space system; the package has no type hints."""


@dataclass(frozen=True, slots=True)
class Margins:
    """What one loop can bear before it oscillates."""

    loop: str
    gain_db: float
    phase_deg: float
    disk_gain_db: float
    disk_phase_deg: float
    crossover_rad_s: float

    @property
    def is_sufficient(self) -> bool:
        return self.gain_db >= GAIN_REQUIRED_DB and self.phase_deg >= PHASE_REQUIRED_DEG


def _fraction(numerator: list[float], denominator: list[float]) -> System:
    return control.ss(control.tf(numerator, denominator))


def _delay(seconds: float) -> System:
    return control.ss(control.tf(*control.pade(seconds, PADE_ORDER)))


def _lag(seconds: float) -> System:
    return _fraction([1.0], [seconds, 1.0])


def _low_pass(cutoff_hz: float) -> System:
    return _lag(1.0 / (2.0 * np.pi * cutoff_hz))


def _pi(gain_p: float, gain_i: float) -> System:
    return _fraction([gain_p, gain_i], [1.0, 0.0]) if gain_i > 0.0 else control.ss(_fraction([gain_p], [1.0]))


_INTEGRATOR = _fraction([1.0], [1.0, 0.0])


def motor_time_s(airframe: MultirotorAirframe) -> float:
    """Mean of the lags of rising and falling speed."""
    return 0.5 * (airframe.rotor_model.spin_up_time_s + airframe.rotor_model.spin_down_time_s)


class Cascade:
    """The open loops of an airframe with given gains, each with the loops inside it closed."""

    def __init__(self, airframe: MultirotorAirframe, gains: Mapping[str, float]) -> None:
        self.gains = gains
        self.actuator = _lag(motor_time_s(airframe)) * _delay(FAST_DELAY_S)

    def _rate(self, axis: str) -> tuple[System, System]:
        """Open rate loop, and closed from rate setpoint to rate; the derivative acts on the measurement only."""
        gains = self.gains
        gyro = _low_pass(gains["gyro_cutoff_hz"])
        plant = self.actuator * _INTEGRATOR
        forward = _pi(gains[f"rate_p_{axis}"], gains[f"rate_i_{axis}"])
        cutoff = gains["gyro_rate_cutoff_hz"] * 2.0 * np.pi
        derivative = _fraction([gains[f"rate_d_{axis}"] * cutoff, 0.0], [1.0, cutoff])
        back = (forward + derivative) * gyro
        return plant * back, control.feedback(plant, back) * forward

    def _attitude(self, axis: str) -> tuple[System, System]:
        gain = self.gains["att_p_roll" if axis == "tilt" else "att_p_yaw"]
        loop = gain * self._rate(axis)[1] * _INTEGRATOR
        return loop, control.feedback(loop, 1)

    def _acceleration(self, axis: str, thrust: float) -> System:
        """From acceleration setpoint to acceleration, with the disturbance observer, `thrust` times the modelled."""
        inner = self._attitude("tilt")[1] if axis == "xy" else self.actuator
        inner = inner * _delay(SLOW_DELAY_S)
        if thrust == 1.0 or self.gains["disturbance_cutoff_hz"] == 0.0:
            return thrust * inner
        seen = (thrust - 1.0) * inner * _low_pass(self.gains["disturbance_cutoff_hz"])
        return thrust * inner * control.feedback(control.ss([], [], [], [[1.0]]), seen)

    def _velocity(self, axis: str, thrust: float = 1.0) -> tuple[System, System]:
        gains = self.gains
        inner = self._acceleration(axis, thrust)
        forward = _pi(gains[f"vel_p_{axis}"], gains[f"vel_i_{axis}"])
        damping = gains[f"vel_d_{axis}"] * _low_pass(gains["accel_cutoff_hz"])
        loop = inner * (forward * _INTEGRATOR + damping)
        closed = control.feedback(inner, forward * _INTEGRATOR + damping) * forward * _INTEGRATOR
        return loop, closed

    def _position(self, axis: str, thrust: float = 1.0) -> System:
        return self.gains[f"pos_p_{axis}"] * self._velocity(axis, thrust)[1] * _INTEGRATOR

    def closed_rate(self, axis: str) -> System:
        """From rate setpoint to rate; `axis` is tilt or yaw."""
        return self._rate(axis)[1]

    def loops(self) -> dict[str, Callable[[], System]]:
        """Open loops by name, from the inside out."""
        return {
            "rate roll/pitch": lambda: self._rate("tilt")[0],
            "rate yaw": lambda: self._rate("yaw")[0],
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


def margins_of(loop: str, system: System) -> Margins:
    """Gain, phase and disk margins of an open loop."""
    gain, phase_deg, _, crossover = control.margin(control.frd(system, OMEGA))
    _, disk_gain_db, disk_phase_deg = control.disk_margins(system, OMEGA)
    gain_db = 20.0 * np.log10(gain) if np.isfinite(gain) else np.inf
    return Margins(loop, float(gain_db), float(phase_deg), float(disk_gain_db), float(disk_phase_deg), float(crossover))


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


def _two_digits(value: float) -> float:
    return float(f"{value:.2g}")


def greatest_gain(loop: System, phase_deg: float, gain_db: float) -> float:
    """The factor by which an open loop may be multiplied to be left with these margins."""
    response = np.asarray(control.frd(loop, OMEGA).frdata[0, 0])
    phase = np.degrees(np.unwrap(np.angle(response)))
    phase -= 360.0 * np.round((phase[len(phase) // 2] + 120.0) / 360.0)  # near crossover it lies round -120 deg
    size = np.abs(response)
    wanted = min(phase_deg - 180.0, float(phase[1:].max()) - 1.0)  # slow motors may not allow it at any gain
    last_ok = int(np.flatnonzero(phase >= wanted)[-1])
    reversal = int(np.flatnonzero(phase >= -180.0)[-1])
    return float(min(1.0 / size[last_ok], 10.0 ** (-gain_db / 20.0) / size[reversal]))


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
        gains.update({name: _two_digits(factor * value) for name, value in unit.items()})
    return gains


def _margin_table(airframe: MultirotorAirframe, rows: list[Margins]) -> Table:
    table = Table(title=f"{airframe.name}: margins with the default gains")
    for heading in ("loop", "crossover\nrad/s", "gain\ndB", "phase\ndeg", "disk gain\ndB", "disk phase\ndeg", "enough"):
        table.add_column(heading, justify="left" if heading == "loop" else "right")
    for row in rows:
        figures = (row.crossover_rad_s, row.gain_db, row.phase_deg, row.disk_gain_db, row.disk_phase_deg)
        verdict = "yes" if row.is_sufficient else "[red]no[/red]"
        table.add_row(row.loop, *(f"{figure:.1f}" for figure in figures), verdict)
    return table


def _gain_table(airframe: MultirotorAirframe, designed: Mapping[str, float]) -> Table:
    table = Table(title=f"{airframe.name}: gains")
    for heading in ("parameter", "default", "designed for this airframe"):
        table.add_column(heading, justify="left" if heading == "parameter" else "right")
    for item in CONTROL_PARAMETERS:
        if item.source.startswith("python -m autopilot.tuning"):
            table.add_row(item.name, f"{item.default:g}", f"{designed[item.field]:g}")
    return table


app = typer.Typer(add_completion=False)


@app.command()
def main(
    airframe: Annotated[str, typer.Option(help="Name of an airframe, or path of its TOML file.")] = "x500",
) -> None:
    """Prints each loop's margins and the gains the design rules give; exit code 1 if a margin is too small."""
    console = Console()
    try:
        frame = load_airframe(airframe)
        if not isinstance(frame, MultirotorAirframe):
            raise AirframeError(f"airframe '{frame.name}': a {frame.vehicle} has other gains than a multirotor")
    except AirframeError as error:
        console.print(str(error), style="red", highlight=False)
        raise typer.Exit(2) from error
    rows = all_margins(frame)
    console.print(_margin_table(frame, rows))
    console.print(_gain_table(frame, design(frame)))
    console.print(
        f"Enough is a gain margin of {GAIN_REQUIRED_DB:.0f} dB and a phase margin of {PHASE_REQUIRED_DEG:.0f} deg; "
        "nothing is required of the disk margins."
    )
    if not all(row.is_sufficient for row in rows):
        raise typer.Exit(1)


if __name__ == "__main__":
    app()
