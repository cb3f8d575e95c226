"""Stand-ins of PX4 and ArduPilot that fly: they exchange as strictly as the plain ones, and speak MAVLink.

As programs, with the original's ports: `python -m bench.standins.pilots px4 INSTANCE [SECONDS]`, which ends after so
many of simulated time, or `ardupilot INSTANCE HOME VEHICLE`. They know the truth, hold places by it, arm, take off, go,
land, and say so; fences, missions and parameters they do not know. What they find wrong with the exchange they print
as `fault: ...`.
"""

import os
import socket
import sys
from collections.abc import Callable
from math import atan2, cos, hypot, inf, radians, sin
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from bench.standins.ardupilot import ArduPilotStandIn, State
from bench.standins.px4 import Px4StandIn
from common.clock import wall_sleep_s

VOICE_US = 50_000  # between its messages
SLOW = 10  # of them, between those that change seldom
EARTH_M = 6_371_000.0
HOVER = 0.5  # guess, of full thrust; what is wrong with it is integrated
G = 9.80665
COPTER, ROVER = 2, 10  # MAV_TYPE
PX4_FRAME = 5  # MAV_FRAME_GLOBAL_INT: it takes no command with a place in any other
ARDUPILOT_LAND, PX4_LAND, PX4_TAKEOFF, PX4_LOITER = 9, 4 << 16 | 6 << 24, 4 << 16 | 2 << 24, 4 << 16 | 3 << 24


class Motion(NamedTuple):
    """Where it is, in truth."""

    pos_ned: tuple[float, float, float]
    """[m] from where it booted."""
    vel_ned: tuple[float, float, float]
    wxyz: tuple[float, float, float, float]
    omega_frd: tuple[float, float, float]


def euler(wxyz: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad]."""
    w, x, y, z = wxyz
    roll = atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    up = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    return roll, atan2(up, max(1.0 - up * up, 1e-12) ** 0.5), atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def bounded(value: float, most: float) -> float:
    return max(-most, min(most, value))


class Pilot:
    """Holds a place, and gets there.

    Args:
        kind: MAV_TYPE.
        first_mode: its number when it boots.
    """

    def __init__(self, kind: int, first_mode: int) -> None:
        self.kind, self.mode = kind, first_mode
        self.is_armed = self.is_landing = False
        self.target_ned: tuple[float, float, float] = (0.0, 0.0, 0.0)
        self.motion: Motion | None = None
        self._sink = 0.0  # integral of the height's error

    @property
    def is_on_ground(self) -> bool:
        return self.motion is None or self.motion.pos_ned[2] > -0.15

    def commands(self, dt_s: float) -> list[float]:
        """Of four motors [0..1], or steering and throttle [-1..1]."""
        motion = self.motion
        if motion is None or not self.is_armed:
            self._sink = 0.0
            return [0.0] * (2 if self.kind == ROVER else 4)
        if self.kind == ROVER:
            return self._driven(motion)
        if self.is_landing:
            north, east, down = self.target_ned
            self.target_ned = (north, east, down + 1.0 * dt_s)
            if self.is_on_ground and self.target_ned[2] > motion.pos_ned[2] + 0.5:
                self.is_armed = self.is_landing = False
        return self._flown(motion, dt_s)

    def _driven(self, motion: Motion) -> list[float]:
        north, east = (self.target_ned[k] - motion.pos_ned[k] for k in (0, 1))
        yaw = euler(motion.wxyz)[2]
        off = (atan2(east, north) - yaw + 3.14159) % 6.28318 - 3.14159
        speed = bounded(0.4 * (hypot(north, east) - 0.5), 1.5) if hypot(north, east) > 0.5 else 0.0
        return [bounded(1.5 * off, 1.0), bounded(0.4 * (speed - hypot(*motion.vel_ned[:2])) + 0.15 * speed, 0.5)]

    def _flown(self, motion: Motion, dt_s: float) -> list[float]:
        roll, pitch, yaw = euler(motion.wxyz)
        error = [aim - here for aim, here in zip(self.target_ned, motion.pos_ned, strict=True)]
        north, east = (bounded(bounded(0.7 * error[k], 2.0) * 1.8 - 1.8 * motion.vel_ned[k], 3.0) for k in (0, 1))
        self._sink = bounded(self._sink + 0.4 * bounded(error[2], 1.0) * dt_s, 4.0)
        down = bounded(2.5 * (bounded(error[2], 1.5) - motion.vel_ned[2]), 3.0) + self._sink
        ahead, right = cos(yaw) * north + sin(yaw) * east, cos(yaw) * east - sin(yaw) * north
        p, q, r = motion.omega_frd
        rolling = bounded(0.10 * (bounded(right / G, 0.3) - roll) - 0.025 * p, 0.1)
        pitching = bounded(0.10 * (bounded(-ahead / G, 0.3) - pitch) - 0.025 * q, 0.1)
        turning = bounded(-0.10 * yaw - 0.1 * r, 0.05)
        lift = HOVER * (1.0 - down / G) / max(cos(roll) * cos(pitch), 0.7)
        mixed = ((-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1))  # front right, rear left, front left, rear right
        thrusts = (lift + a * rolling + b * pitching + c * turning for a, b, c in mixed)
        return [max(0.02, min(1.0, thrust)) ** 0.5 for thrust in thrusts]


class Voice:
    """What a pilot says and is told.

    Args:
        pilot: whose voice it is.
        system_id: its own.
        home: latitude, longitude [deg], altitude [m] of where it booted.
        is_ardupilot: it speaks ArduPilot's numbers; else PX4's.
    """

    def __init__(self, pilot: Pilot, system_id: int, home: tuple[float, float, float], *, is_ardupilot: bool) -> None:
        self.pilot, self.home, self._is_ardupilot = pilot, home, is_ardupilot
        self.mav = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=1)
        self._parsers: dict[int, Any] = {}
        self._next_us, self._count = 0, 0

    def frame(self, time_us: int, links: list["Carrier"]) -> None:
        """Takes in what has come and says what is due."""
        for link in links:
            parser = self._parsers.setdefault(id(link), mavlink.MAVLink(None))
            parser.robust_parsing = True
            for data in link.receive():
                for message in parser.parse_buffer(data) or ():
                    for answer in self._answers(message):
                        link.send(answer.pack(self.mav))
        if time_us >= self._next_us:
            self._next_us = time_us + VOICE_US
            for message in self._news(time_us // 1000):
                data = message.pack(self.mav)
                for link in links:
                    link.send(data)

    def _news(self, time_ms: int) -> list[Any]:
        pilot, motion = self.pilot, self.pilot.motion
        self._count += 1
        found: list[Any] = []
        if self._count % SLOW == 1:
            autopilot = 3 if self._is_ardupilot else 12
            base = 1 | (128 if pilot.is_armed else 0)
            found += [mavlink.MAVLink_heartbeat_message(pilot.kind, autopilot, base, pilot.mode, 4, 3)]
            health = mavlink.MAV_SYS_STATUS_PREARM_CHECK
            found += [mavlink.MAVLink_sys_status_message(health, health, health, 0, 16_000, 0, 90, 0, 0, 0, 0, 0, 0)]
            landed = 1 if pilot.is_on_ground and not pilot.is_armed else 2
            found += [mavlink.MAVLink_extended_sys_state_message(0, landed)]
            lat, lon, alt = self._place((0.0, 0.0, 0.0))
            found += [mavlink.MAVLink_home_position_message(lat, lon, alt, 0, 0, 0, (1, 0, 0, 0), 0, 0, 0)]
            if self._is_ardupilot:
                found += [mavlink.MAVLink_ekf_status_report_message(16 | 512, 0.1, 0.1, 0.1, 0.1, 0.1)]
        if motion is not None:
            velocity = [round(100.0 * part) for part in motion.vel_ned]
            place = self._place(motion.pos_ned)
            heading = round(euler(motion.wxyz)[2] * 5729.58) % 36_000
            found += [
                mavlink.MAVLink_attitude_message(time_ms, *euler(motion.wxyz), *motion.omega_frd),
                mavlink.MAVLink_global_position_int_message(
                    time_ms, *place, round(-1000 * motion.pos_ned[2]), *velocity, heading
                ),
                mavlink.MAVLink_local_position_ned_message(time_ms, *motion.pos_ned, *motion.vel_ned),
            ]
        return found

    def _place(self, pos_ned: tuple[float, float, float]) -> tuple[int, int, int]:
        """1e7 degrees, millimetres."""
        lat, lon, alt = self.home
        north = pos_ned[0] / EARTH_M / radians(1.0)
        east = pos_ned[1] / EARTH_M / radians(1.0) / cos(radians(lat))
        return round((lat + north) * 1e7), round((lon + east) * 1e7), round((alt - pos_ned[2]) * 1000.0)

    def there(self, lat: float, lon: float, alt_amsl_m: float) -> tuple[float, float, float]:
        """A place [m], ned from where it booted."""
        north, east = radians(lat - self.home[0]), radians(lon - self.home[1]) * cos(radians(self.home[0]))
        return north * EARTH_M, east * EARTH_M, self.home[2] - alt_amsl_m

    def _answers(self, message: Any) -> list[Any]:
        kind = message.get_type()
        if kind == "ADSB_VEHICLE":
            return [mavlink.MAVLink_statustext_message(6, f"heard {message.callsign}".encode())]
        if kind not in ("COMMAND_LONG", "COMMAND_INT") or message.target_system != self.mav.srcSystem:
            return []
        is_strange = not self._is_ardupilot and kind == "COMMAND_INT" and message.frame != PX4_FRAME
        result = (
            mavlink.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME if is_strange else 0 if self._obeys(message, kind) else 3
        )
        return [mavlink.MAVLink_command_ack_message(message.command, result)]

    def _obeys(self, message: Any, kind: str) -> bool:
        pilot = self.pilot
        if message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            pilot.is_armed = message.param1 > 0.5
            pilot.target_ned = pilot.target_ned if pilot.motion is None else pilot.motion.pos_ned
        elif message.command == mavlink.MAV_CMD_DO_SET_MODE:
            pilot.mode = int(message.param2) << (0 if self._is_ardupilot else 16) | int(message.param3) << 24
            pilot.is_landing = pilot.mode in (ARDUPILOT_LAND if self._is_ardupilot else PX4_LAND,)
        elif message.command == mavlink.MAV_CMD_NAV_TAKEOFF:
            up_m = message.param7 if self._is_ardupilot else message.param7 - self.home[2]
            pilot.target_ned = (*pilot.target_ned[:2], -up_m)
            pilot.mode = pilot.mode if self._is_ardupilot else PX4_TAKEOFF
        elif message.command == mavlink.MAV_CMD_NAV_LAND:
            pilot.is_landing, pilot.mode = True, PX4_LAND
        elif message.command == mavlink.MAV_CMD_DO_REPOSITION and kind == "COMMAND_INT":
            pilot.target_ned = self.there(message.x * 1e-7, message.y * 1e-7, message.z)
        else:
            return message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        return True

    def climb_is_over(self) -> None:
        """PX4 holds once it is there."""
        pilot = self.pilot
        if pilot.mode == PX4_TAKEOFF and pilot.motion is not None:
            if abs(pilot.motion.pos_ned[2] - pilot.target_ned[2]) < 0.3:
                pilot.mode = PX4_LOITER


class Carrier:
    """A socket that carries bytes: UDP between two ports, or TCP for the one that connects."""

    def __init__(self, own_port: int, to_port: int = 0) -> None:
        self._to = ("127.0.0.1", to_port)
        kind = socket.SOCK_DGRAM if to_port else socket.SOCK_STREAM
        self._socket = socket.socket(socket.AF_INET, kind)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0 if to_port else 1)
        self._socket.bind(("127.0.0.1", own_port))
        self._socket.setblocking(False)
        self._peer: socket.socket | None = self._socket if to_port else None
        if not to_port:
            self._socket.listen(1)

    def receive(self) -> list[bytes]:
        try:
            if self._peer is None:
                self._peer, _ = self._socket.accept()
                self._peer.setblocking(False)
            return [self._peer.recv(65_536)]
        except OSError:
            return []

    def send(self, data: bytes) -> None:
        try:
            if self._to[1]:
                self._socket.sendto(data, self._to)
            elif self._peer is not None:
                self._peer.send(data)
        except OSError:  # nobody there, or slow
            return

    def close(self) -> None:
        self._socket.close()
        if self._peer is not None:
            self._peer.close()


def fly_px4(instance: int, seconds: float) -> None:
    """A copter, for so long, or until the simulator has gone."""
    pilot = Pilot(COPTER, PX4_LOITER)
    voice: Voice | None = None
    links = [Carrier(14280 + instance, 14030 + instance), Carrier(18570 + instance, 14550)]
    links.append(Carrier(14580 + instance, min(14540 + instance, 14549)))
    seen = 0

    def control(px4: Px4StandIn) -> list[float]:
        nonlocal voice, seen
        truth, sensor = px4.truth, px4.sensor
        if truth is not None and sensor is not None:
            place = truth.lat * 1e-7, truth.lon * 1e-7, truth.alt * 1e-3
            voice = voice or Voice(pilot, instance + 1, place, is_ardupilot=False)
            velocity = (truth.vx * 1e-2, truth.vy * 1e-2, truth.vz * 1e-2)
            gyro = (sensor.xgyro, sensor.ygyro, sensor.zgyro)
            pilot.motion = Motion(voice.there(*place), velocity, tuple(truth.attitude_quaternion), gyro)
            voice.climb_is_over()
            voice.frame(px4.time_us, links)
        for fault in px4.faults[seen:]:
            print(f"fault: {fault}", flush=True)
        seen = len(px4.faults)
        return pilot.commands(0.004)

    px4 = _connected(lambda: Px4StandIn(4560 + instance, control))
    while px4.time_us < seconds * 1e6 and px4.step():
        pass


def _connected(connect: Callable[[], Px4StandIn]) -> Px4StandIn:
    """As the original, which tries until somebody is there."""
    while True:
        try:
            return connect()
        except ConnectionError:
            wall_sleep_s(0.1)


def fly_ardupilot(instance: int, home: str, vehicle: str) -> None:
    """A copter or a rover, until it is ended."""
    kind = ROVER if vehicle == "rover" else COPTER
    pilot = Pilot(kind, 0)
    lat, lon, alt = (float(part) for part in home.split(",")[:3])
    voice: Voice | None = None
    links = [Carrier(5760 + 10 * instance)]
    booted: tuple[float, float, float] | None = None

    def control(state: State | None) -> list[int]:
        nonlocal voice, booted
        if state is not None:
            if booted is None:
                booted = (state.position[0], state.position[1], state.position[2])
                if hypot(*booted[:2]) > 0.5:
                    print(f"fault: boots {booted} from its home", flush=True)
            here = (state.position[0] - booted[0], state.position[1] - booted[1], state.position[2] - booted[2])
            pilot.motion = Motion(here, state.velocity, state.quaternion, state.gyro)
            voice = voice or Voice(pilot, instance + 1, (lat, lon, alt - booted[2]), is_ardupilot=True)
            voice.frame(sitl.time_us, links)
        commands = pilot.commands(0.001)
        if kind == ROVER:
            return [round(1500 + 500 * commands[0]), 1500, round(1500 + 500 * commands[1])]
        return [round(1000 + 1000 * command) for command in commands]

    sitl = ArduPilotStandIn(9002 + 10 * instance, control)
    unreadable = 0
    while os.getppid() > 1:
        sitl.frame()
        if sitl.unreadable_count > unreadable:
            unreadable = sitl.unreadable_count
            print("fault: unreadable", flush=True)


def main(kind: str, instance: str, *rest: str) -> None:
    if kind == "px4":
        fly_px4(int(instance), float(rest[0]) if rest else inf)
    else:
        fly_ardupilot(int(instance), *rest)


if __name__ == "__main__":
    main(*sys.argv[1:])
