"""Margins of open loops and the gains that leave them: what the design tools of all classes share (`make tune`).

python-control is used at design time only; nothing that flies or drives imports this.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import control
import numpy as np

from common.kernels import FRAME_TICKS, TICK_S

PHASE_REQUIRED_DEG = 45.0
GAIN_REQUIRED_DB = 6.0
GAIN_DESIGN_DB = 8.0
"""Room above what is required for airframes and batteries that differ from their file."""

FAST_DELAY_S = 1.5 * TICK_S
"""IMU averaging (half a tick), holding the command (half), and half a tick for transport and computing."""
SLOW_DELAY_S = 0.5 * FRAME_TICKS * TICK_S
"""Holding what a loop of 50 Hz asks for between its frames."""
PADE_ORDER = 3
OMEGA = np.logspace(-2, 3, 1200)  # [rad/s]

Gains = dict[str, float]
"""Fields of a law's kernel struct of gains, and their values in SI."""
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


@dataclass(frozen=True, slots=True)
class Design:
    """What the design tool of a class says of an airframe."""

    margins: list[Margins]
    gains: Mapping[str, float]
    """By field, as the rules give them for this airframe."""


def fraction(numerator: list[float], denominator: list[float]) -> System:
    """A system of a transfer function's coefficients, the highest power first."""
    return control.ss(control.tf(numerator, denominator))


def delay(seconds: float) -> System:
    return control.ss(control.tf(*control.pade(seconds, PADE_ORDER)))


def lag(seconds: float) -> System:
    return fraction([1.0], [seconds, 1.0])


def low_pass(cutoff_hz: float) -> System:
    return lag(1.0 / (2.0 * np.pi * cutoff_hz))


def pi(gain_p: float, gain_i: float) -> System:
    return fraction([gain_p, gain_i], [1.0, 0.0]) if gain_i > 0.0 else control.ss(fraction([gain_p], [1.0]))


INTEGRATOR = fraction([1.0], [1.0, 0.0])


def margins_of(loop: str, system: System) -> Margins:
    """Gain, phase and disk margins of an open loop; the disk's as python-control's `disk_margins`, of one response."""
    response = control.frd(system, OMEGA)
    gain, phase_deg, _, crossover = control.margin(response)
    gain_db = 20.0 * np.log10(gain) if np.isfinite(gain) else np.inf
    disk = 1.0 / np.abs(1.0 / (1.0 + np.asarray(response.frdata[0, 0])) - 0.5).max()
    gamma = (2.0 + disk) / (2.0 - disk) if disk < 2.0 else np.inf
    disk_gain_db = 20.0 * np.log10(gamma)
    disk_phase_deg = np.degrees(np.arccos(2.0 / (gamma + 1.0 / gamma)))
    return Margins(loop, float(gain_db), float(phase_deg), float(disk_gain_db), float(disk_phase_deg), float(crossover))


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


def two_digits(value: float) -> float:
    """As many as a gain deserves."""
    return float(f"{value:.2g}")
