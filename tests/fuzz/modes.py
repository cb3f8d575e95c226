"""A vehicle that is kept in a flight mode while stations send it whatever they like, all of it addressed to it.

It may go anywhere, and is brought back when it has left the mode, landed or been switched off. What must hold in every
frame: nothing raises, everything it knows and asks for is finite, and no frame costs more than FRAME_MAX_S.
"""

import gc
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory
from time import thread_time

import numpy as np

from autopilot.interface.client_requests import ChangeMode, OffboardSetpoint, TakeOff
from autopilot.interface.item_lists import ListKind, MissionItem
from autopilot.interface.vehicle_state import Mode, Verdict
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.ports import SETPOINT_TRAJECTORY
from common.geodesy import geodetic_from_ned
from common.state_folder import StateFolder
from mission.flight import Flight, FlightConfig
from tests.fuzz.messages import Messages

FRAME_MAX_S = 0.02  # of the processor time of the flight's own thread
HEIGHT_M = 30.0
STATIONS = 8
PER_FRAME = 3  # messages of each station
STAY = 10  # frames in which it may be elsewhere before it is brought back
LOST_MAX = 3  # frames in a row whose estimate is no number: measurements of vision may contradict one another so
PILOT = (250, 1)
REFUSED_MAX = 50  # in a row: this vehicle cannot come back to the mode
STICK_MODES = frozenset({Mode.MANUAL, Mode.STABILIZED, Mode.ACRO, Mode.ALTITUDE, Mode.POSITION})
SETPOINT_FIELDS = ("pos_ned", "vel_ned", "accel_ned", "yaw", "yaw_rate", "thrust", "q_ned_from_frd", "omega_frd")


class ModeFlight:
    """A vehicle that is sent from mode to mode, and replaced when it cannot fly any more.

    Args:
        seed: of the traffic.
        dialect: what the stations take it for.
    """

    def __init__(self, seed, dialect):
        self._rng = np.random.default_rng([seed, dialect == "px4"])
        self._dialect = dialect
        self.mode = Mode.HOLD
        self.sent = self.flights = 0
        self.frames = dict.fromkeys(Mode, 0)
        self.frames_in = dict.fromkeys(Mode, 0)  # it was in the mode in which it was to be
        self.worst_frame_s = 0.0
        self._flight = None
        self._elsewhere = self._refused = self._lost_frames = 0

    def send(self, mode, count):
        """Sends `count` messages while it is kept in a mode."""
        self.mode, self._elsewhere = mode, STAY
        end = self.sent + count
        while self.sent < end:
            if self._flight is None:
                self._take_off()
            self._keep_in_mode()
            if self._flight is None:
                continue
            for station, link in enumerate(self._ends):
                for _ in range(PER_FRAME):
                    link.send(self._messages[station].valid())
            self.sent += STATIONS * PER_FRAME
            self._frame()

    def close(self):
        if self._flight is not None:
            self._flight.close()
            self._state.close()
            self._folder.cleanup()
            self._flight = None

    def _take_off(self):
        """A new vehicle in the air, in Hold."""
        self._folder = TemporaryDirectory()
        self._state = StateFolder(Path(self._folder.name))
        pairs = [memory_pair(LinkRole.GROUND) for _ in range(STATIONS)]
        self._ends = [station_end for _, station_end in pairs]
        flight = self._flight = Flight(
            FlightConfig(noise=0.0, dialect=self._dialect, traffic_count=2, has_lidar=True, parameters=PARAMETERS),
            links=[vehicle_end for vehicle_end, _ in pairs],
            state=self._state,
            has_camera_thread=True,
        )
        server = flight.server
        rng = np.random.default_rng(self._rng.integers(1 << 62))
        asked = (server.message_handlers(), server.command_handlers(), server._endpoint.parameters.names)
        self._messages = [Messages(rng, *asked, (255 - i, 190), is_bold=True) for i in range(STATIONS)]
        if self.flights == 0:
            gc.freeze()  # as flights do that are shown to somebody
        self.flights += 1
        running = flight.fly(climb, seconds=60.0)
        assert running.error is None, running.error
        self._elsewhere = STAY

    def _keep_in_mode(self):
        """What a pilot or a companion does to stay in the mode; a vehicle that cannot come back is left."""
        flight, mode = self._flight, self.mode
        controller, state = flight.controller, flight.controller.state
        if mode in STICK_MODES:
            axes = self._rng.uniform(-0.3, 0.3, 4).tolist()
            controller.sticks.joystick_moved(PILOT, state.time_us, tuple(axes), 0)
        elif mode is Mode.OFFBOARD and controller.navigator.modes[mode].stream_age_us() > 200_000:
            place = (5.0, 5.0, -HEIGHT_M)
            controller.request(OffboardSetpoint(state.time_us, SETPOINT_TRAJECTORY, pos_ned=place))
        is_there = state.mode is mode and state.is_armed
        self._elsewhere = 0 if is_there else self._elsewhere + 1
        if self._elsewhere < STAY:
            return
        if not state.is_armed or not state.is_flying:
            self.close()
            return
        if mode is Mode.MISSION:
            controller.lists.load(ListKind.FENCE, [])  # its shapes are as random as all the rest
            controller.lists.load(ListKind.MISSION, mission())
        if mode is Mode.TERMINATION:
            controller.terminate()
        elif mode is Mode.TAKEOFF:
            controller.request(TakeOff(state.position.alt_m + HEIGHT_M, nan))
        elif controller.request(ChangeMode(mode)).verdict is not Verdict.ACCEPTED:
            self._refused += 1
            if self._refused > REFUSED_MAX:
                self.close()
            return
        self._elsewhere = self._refused = 0

    def _frame(self):
        flight = self._flight
        start_s = thread_time()
        flight.frame()
        self.worst_frame_s = max(self.worst_frame_s, thread_time() - start_s)
        for end in self._ends:
            end.receive()
        state = flight.controller.state
        self.frames[self.mode] += 1
        self.frames_in[self.mode] += state.mode is self.mode
        setpoint = flight.rig.arrays.autopilot.setpoint.numpy()[0]
        for name in SETPOINT_FIELDS:
            assert not np.isinf(setpoint[name]).any(), f"{name}: {setpoint[name]}"
        body = flight.rig.rows["truth"][0]
        for name in ("pos_ned", "vel_ned", "q_ned_from_frd", "omega_frd"):
            assert np.isfinite(body[name]).all(), f"{name}: {body[name]}"
        estimate = state.estimate
        is_lost = not np.isfinite([*estimate.pos_ned, *estimate.vel_ned, *estimate.q_ned_from_frd]).all()
        self._lost_frames = self._lost_frames + 1 if is_lost else 0
        assert self._lost_frames <= LOST_MAX, estimate
        modes = flight.controller.navigator.modes
        for target in (modes[Mode.FOLLOW].target, modes[Mode.PRECISION_LAND].target):
            assert np.isfinite([*target.pos_ned, *target.vel_ned]).all(), (target.pos_ned, target.vel_ned)


PARAMETERS = {"EKF2_EV_CTRL": 15.0, "COM_RC_IN_MODE": 1.0}


async def climb(drone):
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(HEIGHT_M)


def mission():
    """Four places in a square, over and over."""
    home = FlightConfig().home
    corners = [(40.0, 0.0), (40.0, 40.0), (0.0, 40.0), (0.0, 0.0)]
    places = [geodetic_from_ned(north, east, 0.0, home) for north, east in corners]
    params = (0.0, 0.0, 0.0, nan)
    items = [MissionItem(i, 3, 16, params, lat, lon, HEIGHT_M) for i, (lat, lon, _) in enumerate(places)]
    return [*items, MissionItem(4, 2, 177, (0.0, -1.0, 0.0, 0.0), 0.0, 0.0, 0.0)]
