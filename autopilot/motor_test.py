"""Motor tests: motors turned one by one on the ground, to see which is which and which way it turns.

In: requests of clients. Out: motor commands in the setpoint row, which the control part passes on while the vehicle is
disarmed and never otherwise. A spin ends by itself after its time, and all end when the vehicle is armed, or when a
client disarms it, terminates it or restarts it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import ACCEPTED, LandedState, Reply, Severity, VehicleState, Verdict
from autopilot.navigator.setpoint import SetpointPort
from common.kernels import MAX_MOTORS


@dataclass(frozen=True, slots=True)
class Spin:
    """One motor, turning for a while."""

    motor: int  # from 0
    command: float  # [0..1]
    begin_us: int
    end_us: int


class MotorTest:
    """The motor test of one vehicle.

    Args:
        state: the vehicle as of this frame.
        setpoint: takes the motor commands.
        announcer: where texts go.
        clockwise: its motors from 0, from the nose on.
    """

    def __init__(
        self, state: VehicleState, setpoint: SetpointPort, announcer: Announcer, clockwise: Sequence[int]
    ) -> None:
        self._state = state
        self._setpoint = setpoint
        self._announcer = announcer
        self._spins: list[Spin] = []
        self.motor_count = len(clockwise)
        self.clockwise = clockwise

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

    def spin(self, motors: Sequence[int], command: float, seconds: float, *, pause_s: float = 0.0) -> Reply:
        """Turns motors one after the other, instead of what they were to do; the others go on.

        Args:
            motors: from 0, in this order.
            command: [0..1] what the ESC receives.
            seconds: for each; 0 stops it.
            pause_s: between two of them.
        """
        refusal = self.refusal()
        if refusal is not None:
            return refusal
        if not motors or not all(0 <= motor < self.motor_count for motor in motors):
            return Reply(Verdict.DENIED, f"motor test: there are motors 1 to {self.motor_count}")
        if not (isfinite(command) and 0.0 <= command <= 1.0):
            return Reply(Verdict.DENIED, "motor test: the throttle is between 0 and 100 %")
        if not (isfinite(seconds) and seconds >= 0.0):
            return Reply(Verdict.DENIED, "motor test: the time is no time")
        self._spins = [spin for spin in self._spins if spin.motor not in motors]
        begin_us = self._state.time_us
        for motor in motors if seconds > 0.0 else ():
            end_us = begin_us + round(seconds * 1e6)
            self._spins.append(Spin(motor, command, begin_us, end_us))
            begin_us = end_us + round(pause_s * 1e6)
        names = ", ".join(str(motor + 1) for motor in motors)
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
        commands = [0.0] * MAX_MOTORS
        for spin in self._spins:
            if spin.begin_us <= self._state.time_us:
                commands[spin.motor] = spin.command
        self._setpoint.test_motors(tuple(commands))
