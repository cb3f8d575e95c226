"""Commands that turn single motors on the ground: DO_MOTOR_TEST, and PX4's ACTUATOR_TEST."""

from collections.abc import Mapping, Sequence
from math import isnan

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Reply, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.mavlink.wire.convert import whole

PX4_LONGEST_S = 3.0
ARDUPILOT_LONGEST_S = 600.0
_PAUSE = 0.5  # between two motors, of a motor's time (ArduPilot)
_PULSE_MIN_US, _PULSE_SPAN_US = 1000.0, 1000.0
_FIRST_MOTOR, _LAST_MOTOR = mavlink.ACTUATOR_OUTPUT_FUNCTION_MOTOR1, mavlink.ACTUATOR_OUTPUT_FUNCTION_MOTOR16


class MotorTestService(Service):
    """Passes motor tests on, in the order and with the time limits of the dialect's autopilot."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._is_ardupilot = endpoint.dialect.name == "ardupilot"

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            mavlink.MAV_CMD_DO_MOTOR_TEST: self._test,
            mavlink.MAV_CMD_ACTUATOR_TEST: self._test_actuator,
        }

    def _test(self, command: Command) -> Reply:
        """Turns one motor on the ground, or several one after the other.

        Params: p1 the first motor from 1: in PX4's dialect by its number, in ArduPilot's clockwise from the nose (p6 2:
        by its number there, too); p2 type of p3: 0 per cent, 1 pulse [us]; p3 throttle; p4 time for each [s]: PX4 at
        most 3, which 0 means, too; ArduPilot at most 600, and 0 stops; p5 how many, with pauses.
        Refused: TEMPORARILY_REJECTED while armed, in the air or calibrating; DENIED for a motor there is not, and for a
        throttle or a time out of range; UNSUPPORTED for another type of throttle.
        """
        tests = self._endpoint.vehicle.motor_test
        first, count = whole(command.p1, 0) - 1, max(whole(command.x, 1), 1)
        if not (first >= 0 and first + count <= tests.motor_count):
            return denied(f"motor test: there are motors 1 to {tests.motor_count}")
        throttle_type = whole(command.p2, -1)
        if throttle_type == mavlink.MOTOR_TEST_THROTTLE_PERCENT:
            throttle = command.p3 / 100.0
        elif throttle_type == mavlink.MOTOR_TEST_THROTTLE_PWM:
            throttle = (command.p3 - _PULSE_MIN_US) / _PULSE_SPAN_US
        else:
            return Reply(Verdict.UNSUPPORTED, "motor test: the throttle is given in per cent or as a pulse")
        seconds = 0.0 if isnan(command.p4) else command.p4
        by_number = not self._is_ardupilot or whole(command.y, 0) == mavlink.MOTOR_TEST_ORDER_BOARD
        order: Sequence[int] = range(tests.motor_count) if by_number else tests.clockwise
        seconds = self._bounded_s(seconds)
        return tests.spin(order[first : first + count], throttle, seconds, pause_s=_PAUSE * seconds)

    def _bounded_s(self, seconds: float) -> float:
        if self._is_ardupilot:
            return min(seconds, ARDUPILOT_LONGEST_S)
        return PX4_LONGEST_S if seconds == 0.0 else min(seconds, PX4_LONGEST_S)

    def _test_actuator(self, command: Command) -> Reply:
        """Turns a motor on the ground.

        Params: p1 throttle, 0 to 1, NaN: off; p2 time [s], at most 3, 0: off; p5 motor: its ACTUATOR_OUTPUT_FUNCTION,
        1 to 16.
        Refused: TEMPORARILY_REJECTED while armed, in the air or calibrating; DENIED for a motor there is not, or a
        throttle or time out of range; UNSUPPORTED for an actuator that is no motor.
        """
        function = whole(command.x, 0)
        if not _FIRST_MOTOR <= function <= _LAST_MOTOR:
            return Reply(Verdict.UNSUPPORTED, "actuator test: only motors can be tested")
        is_off = isnan(command.p1) or isnan(command.p2) or command.p2 == 0.0
        throttle, seconds = (0.0, 0.0) if is_off else (command.p1, min(command.p2, PX4_LONGEST_S))
        return self._endpoint.vehicle.motor_test.spin([function - _FIRST_MOTOR], throttle, seconds)
