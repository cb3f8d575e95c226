"""Motor tests: rotors turned one by one on the ground, to see which is which and which way it turns.

In: requests of clients. Out: motor commands in the setpoint row, which the control part passes on while the vehicle is
disarmed and never otherwise. A spin ends by itself after its time, and all end when the vehicle is armed, or when a
client disarms it, terminates it or restarts it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, isfinite, pi

from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import ACCEPTED, LandedState, Reply, Severity, VehicleState, Verdict
from autopilot.navigator.setpoint import SetpointPort
from common.airframe import Airframe
from common.kernels import MAX_ROTORS


@dataclass(frozen=True, slots=True)
class Spin:
    """One rotor, turning for a while."""

    rotor: int  # from 0
    command: float  # [0..1]
    begin_us: int
    end_us: int


class MotorTest:
    """The motor test of one vehicle.

    Args:
        state: the vehicle as of this frame.
        setpoint: takes the motor commands.
        announcer: where texts go.
        airframe: where its rotors are.
    """

    def __init__(self, state: VehicleState, setpoint: SetpointPort, announcer: Announcer, airframe: Airframe) -> None:
        self._state = state
        self._setpoint = setpoint
        self._announcer = announcer
        self._spins: list[Spin] = []
        self.rotor_count = len(airframe.rotors)
        angles = [atan2(rotor.y_m, rotor.x_m) % (2.0 * pi) for rotor in airframe.rotors]
        self.clockwise: Sequence[int] = sorted(range(self.rotor_count), key=lambda rotor: round(angles[rotor], 6))

    @property
    def is_running(self) -> bool:
        return bool(self._spins)

    def refusal(self) -> Reply | None:
        """Why no motor may be tested now; None if one may."""
        state = self._state
        if state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "motor test: the vehicle is armed")
        if state.landed_state not in (LandedState.ON_GROUND, LandedState.UNDEFINED):
            return Reply(Verdict.TEMPORARILY_REJECTED, "motor test: the vehicle is not on the ground")
        if state.is_calibrating:
            return Reply(Verdict.TEMPORARILY_REJECTED, "motor test: a calibration is running")
        return None

    def spin(self, rotors: Sequence[int], command: float, seconds: float, *, pause_s: float = 0.0) -> Reply:
        """Turns rotors one after the other, instead of what they were to do; the others go on.

        Args:
            rotors: from 0, in this order.
            command: [0..1] what the ESC receives.
            seconds: for each; 0 stops it.
            pause_s: between two of them.
        """
        refusal = self.refusal()
        if refusal is not None:
            return refusal
        if not rotors or not all(0 <= rotor < self.rotor_count for rotor in rotors):
            return Reply(Verdict.DENIED, f"motor test: there are motors 1 to {self.rotor_count}")
        if not (isfinite(command) and 0.0 <= command <= 1.0):
            return Reply(Verdict.DENIED, "motor test: the throttle is between 0 and 100 %")
        if not (isfinite(seconds) and seconds >= 0.0):
            return Reply(Verdict.DENIED, "motor test: the time is no time")
        self._spins = [spin for spin in self._spins if spin.rotor not in rotors]
        begin_us = self._state.time_us
        for rotor in rotors if seconds > 0.0 else ():
            end_us = begin_us + round(seconds * 1e6)
            self._spins.append(Spin(rotor, command, begin_us, end_us))
            begin_us = end_us + round(pause_s * 1e6)
        names = ", ".join(str(rotor + 1) for rotor in rotors)
        self._announcer.statustext(Severity.INFO, f"Motor test: motor {names}, {100.0 * command:.0f} %")
        self._write()
        return ACCEPTED

    def stop(self) -> None:
        """Ends every spin."""
        if self._spins:
            self._announcer.statustext(Severity.WARNING, "Motor test: ended")
            self._spins = []
            self._write()

    def frame(self) -> None:
        """Begins and ends what is due; called while something turns."""
        if self.refusal() is not None:
            self.stop()
            return
        now_us = self._state.time_us
        self._spins = [spin for spin in self._spins if now_us < spin.end_us]
        self._write()
        if not self._spins:
            self._announcer.statustext(Severity.INFO, "Motor test: finished")

    def _write(self) -> None:
        commands = [0.0] * MAX_ROTORS
        for spin in self._spins:
            if spin.begin_us <= self._state.time_us:
                commands[spin.rotor] = spin.command
        self._setpoint.test_motors(tuple(commands))
