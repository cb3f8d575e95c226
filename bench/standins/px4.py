"""PX4's SITL as its simulator link shows it, written after SimulatorMavlink.cpp, on pymavlink's own messages.

It connects, asks for the truth, and takes its clock from HIL_SENSOR of id 0, which must go on. A copter answers every
sample of the gyro, a rover 100 times a second and only while armed. As a program it flies nothing and answers at once:
for rows of speed.
"""

import socket
import sys
from collections.abc import Callable, Sequence

from pymavlink.dialects.v20 import common as mavlink

ACCEL, GYRO, MAG, BARO, AIRSPEED = 0x7, 0x38, 0x1C0, 0x1A00, 0x400
ARMED, LOCKSTEP = 128, 1
SILENCE_S = 1.0  # of wall clock time: then it prints "poll timeout"
ROVER_PERIOD_US = 10_000
TICK_US = 4_000  # of the simulator
EQUAL_MAX = 100  # DataValidator: a sensor that repeats itself so often is stale


class Px4StandIn:
    """One PX4.

    Args:
        port: of the simulator.
        control: its 16 actuator controls, asked at each answer; None: zeros.
        is_rover: it answers at 100 Hz, and while armed only.
        is_armed: else its controls are zeros.
        system_id: the instance plus 1.
    """

    def __init__(
        self,
        port: int,
        control: Callable[["Px4StandIn"], Sequence[float]] | None = None,
        *,
        is_rover: bool = False,
        is_armed: bool = True,
        system_id: int = 1,
    ) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.settimeout(SILENCE_S)
        self._mav = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=1)
        self._mav.robust_parsing = True
        self._control = control or (lambda _: [0.0] * 16)
        self.is_rover, self.is_armed = is_rover, is_armed
        self.time_us = 0
        self._answered_us = 0
        self.sensor: mavlink.MAVLink_hil_sensor_message | None = None
        self.pressure_pa = 0.0  # of the pitot tube
        self.gps: mavlink.MAVLink_hil_gps_message | None = None
        self.truth: mavlink.MAVLink_hil_state_quaternion_message | None = None
        self.counts = {"sensor": 0, "mag": 0, "baro": 0, "airspeed": 0, "gps": 0, "truth": 0, "answers": 0}
        self.faults: list[str] = []
        self.timeout_count = 0
        self._last_values: dict[str, tuple[float, ...]] = {}
        self._same: dict[str, int] = {}
        asked = mavlink.MAVLink_command_long_message(0, 0, 511, 0, 115.0, 5000.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.send(asked)
        self.send(mavlink.MAVLink_heartbeat_message(6, 12, 0, 0, 0, 3))

    def send(self, message: mavlink.MAVLink_message) -> None:
        self.socket.sendall(message.pack(self._mav))

    def step(self) -> bool:
        """Reads what has come in and answers; False: the simulator has gone."""
        try:
            data = self.socket.recv(65_536)
        except TimeoutError:
            self.timeout_count += 1  # it prints "poll timeout"
            return True
        except OSError:
            return False
        if not data:
            return False
        for message in self._mav.parse_buffer(data) or ():
            self._handle(message)
        return True

    def _handle(self, message: mavlink.MAVLink_message) -> None:
        kind = message.get_type()
        if kind == "BAD_DATA":
            self.faults.append("bad data")
        elif kind == "HIL_SENSOR":
            self._take_sensor(message)
            self._answer()
        elif kind == "HIL_GPS":
            self.counts["gps"] += 1
            self.gps = message
        elif kind == "HIL_STATE_QUATERNION":
            self.counts["truth"] += 1
            self.truth = message

    def _take_sensor(self, message: mavlink.MAVLink_hil_sensor_message) -> None:
        if message.id == 0:
            if message.time_usec <= self.time_us:
                self.faults.append(f"clock stands or goes back: {message.time_usec}")
            self.time_us = message.time_usec
        self.counts["sensor"] += 1
        self.sensor = message
        groups = {
            "accel": (ACCEL, (message.xacc, message.yacc, message.zacc)),
            "gyro": (GYRO, (message.xgyro, message.ygyro, message.zgyro)),
            "mag": (MAG, (message.xmag, message.ymag, message.zmag)),
            "baro": (BARO, (message.abs_pressure, message.pressure_alt)),
            "airspeed": (AIRSPEED, (message.diff_pressure,)),
        }
        for name, (bits, values) in groups.items():
            updated = message.fields_updated & bits
            if updated not in (0, bits):
                self.faults.append(f"{name}: half a group")
            if updated == bits:
                if name == "airspeed":
                    self.pressure_pa = 100.0 * message.diff_pressure  # it is in hPa
                if name in self.counts:
                    self.counts[name] += 1
                same = self._same.get(name, 0) + 1 if self._last_values.get(name) == values else 0
                if same > EQUAL_MAX:
                    self.faults.append(f"{name}: stale")
                self._last_values[name], self._same[name] = values, same

    def _answer(self) -> None:
        if self.is_rover and (not self.is_armed or self.time_us - self._answered_us < ROVER_PERIOD_US):
            return
        self._answered_us = self.time_us
        controls = list(self._control(self)) if self.is_armed else [0.0] * 16
        controls += [0.0] * (16 - len(controls))
        mode = 1 | (ARMED if self.is_armed else 0)
        self.send(mavlink.MAVLink_hil_actuator_controls_message(self.time_us, controls, mode, LOCKSTEP))
        self.counts["answers"] += 1

    def close(self) -> None:
        self.socket.close()


def main(port: int, seconds: float) -> None:
    """Answers at once for some simulated seconds, then tells what it has counted."""
    px4 = Px4StandIn(port)
    while px4.time_us < seconds * 1e6 and px4.step():
        pass
    px4.close()
    print(f"faults={len(px4.faults)} exchanged_us={px4.counts['sensor'] * TICK_US} clock_us={px4.time_us}")


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]))
