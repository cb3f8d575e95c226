"""Random flights: modes, commands, missions, fences, sticks and failures in any order, watched in truth.

A `Scenario` draws everything from its seed. It judges each frame by the simulator's own position and attitude, and ends
with a return with healthy sensors, after which the vehicle stands with its motors off.
"""

from math import cos, degrees, hypot, nan, sin

import numpy as np

from autopilot.interface.client_requests import (
    ChangeMode,
    ChangeSpeed,
    GoTo,
    LandAt,
    LandingTargetReport,
    OffboardSetpoint,
    OrbitRequest,
    SetCurrentItem,
    SetHome,
    StartMission,
    TakeOff,
    TargetReport,
)
from autopilot.interface.item_lists import ListKind, MissionItem
from autopilot.interface.vehicle_state import LandedState, Mode, Verdict
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.ports import SETPOINT_TRAJECTORY
from common.geodesy import geodetic_from_ned
from common.kernels import FRAME_US
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

PLAIN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
MODES = tuple(mode for mode in Mode if mode is not Mode.TERMINATION)
BY_THRUST = frozenset((Mode.MANUAL, Mode.STABILIZED, Mode.ACRO))  # the pilot alone keeps it in the air
STEERED = frozenset((Mode.ALTITUDE, Mode.POSITION))  # a pilot may drag it over the ground
GNSS, BARO, MAG, RANGE, BATTERY, RC_SIGNAL = 4, 3, 2, 7, 100, 104  # FAILURE_UNIT
OK, OFF = 0, 1  # FAILURE_TYPE
SENSORS = (GNSS, BARO, MAG, RANGE, RC_SIGNAL)
CHOICES = {
    "NAV_RCL_ACT": (1, 2, 3, 7), "NAV_DLL_ACT": (0, 1, 2, 3, 7), "COM_LOW_BAT_ACT": (0, 2, 3),
    "GF_ACTION": (1, 2, 3, 5), "COM_OBL_RC_ACT": (3, 4, 5), "COM_RC_OVERRIDE": (0, 1, 3), "RTL_LAND_DELAY": (0, 2),
    "RTL_TYPE": (0, 1, 2, 3, 4, 5),
    "MPC_YAW_MODE": (0, 1, 2, 3), "RTL_RETURN_ALT": (5, 15, 30), "COM_POSCTL_NAVL": (0, 1), "GF_PREDICT": (0, 1),
    "MIS_RESTART": (0, 1), "RTL_CONE_ANG": (0, 45), "COM_RCL_EXCEPT": (0, 1, 7), "COM_FLT_TIME_MAX": (-1, -1, 60),
}  # fmt: skip
LEFT_ALONE = 8.0  # [s] the longest pause between two events
UNDERGROUND_M = 0.3
AIRBORNE_M = 1.0  # motors that stop higher than this have stopped in the air
SPEED_MARGIN_M_S = 4.0  # wind, and the overshoot of a braking vehicle
TILT_MAX_DEG = 70.0  # the control's limit is 45, gusts and yaw come on top
FENCE_MARGIN_M = 6.0  # gusts, and where the estimate errs
HOME_S = 400.0  # for the return at the end


class Violation(AssertionError):
    """An invariant does not hold."""


class Wrecked(Exception):
    """The pilot has flown the vehicle into the ground, or the wind has, without any position."""


class Scenario:
    """One random flight.

    Args:
        seed: draws everything.
        seconds: of events.
        fails: whether sensors fail.
    """

    def __init__(self, seed, seconds=60.0, *, fails=True, **parameters):
        self.rng = rng = np.random.default_rng(seed)
        chosen = {name: float(rng.choice(values)) for name, values in CHOICES.items()}
        self.flight = Flight(
            FlightConfig(
                seed=seed, world=PLAIN, wind_m_s=float(rng.choice([0.0, 4.0, 10.0])),
                parameters={"SYS_FAILURE_EN": 1.0, "COM_RC_IN_MODE": 3.0, **chosen, **parameters},
            )
        )  # fmt: skip
        self.fc = self.flight.controller
        self.state = self.fc.state
        self.drone = self.flight.drone
        self.body = self.flight.rig.rows["truth"]
        self.seconds, self.fails = seconds, fails
        self.log = []
        self.sticks = None  # held there
        self.has_station = self.has_target = False
        self.stream = None  # an offboard setpoint
        self.was_armed = False
        self.mode_since_us = 0
        self.mode = None

    # ---- time ----

    def frame(self):
        now_us = self.flight.time_us
        if self.sticks is not None:
            self.fc.sticks.joystick_moved((255, 190), now_us, self.sticks, 0)
        if self.has_station and now_us % 1_000_000 == 0:
            self.fc.station.heard(now_us)
        if self.stream is not None and now_us % 100_000 == 0:
            self.fc.request(self.stream)
        if self.has_target and now_us % 200_000 == 0:
            angle = now_us * 0.1e-6
            place = (20.0 * cos(angle), 20.0 * sin(angle), 0.0)
            self.fc.request(TargetReport(place, (-2.0 * sin(angle), 2.0 * cos(angle), 0.0), 0.5, 0.3))
            self.fc.request(LandingTargetReport((5.0, 5.0, 0.0)))
        self.flight.frame()
        self.judge()

    def run(self, seconds):
        for _ in range(round(seconds * 1e6 / FRAME_US)):
            self.frame()

    def until(self, condition, seconds, what):
        for _ in range(round(seconds * 1e6 / FRAME_US)):
            if condition():
                return
            self.frame()
        self.fail(f"not {what} within {seconds:g} s")

    # ---- truth ----

    @property
    def pos_ned(self):
        return self.body[0]["pos_ned"].astype(float)

    @property
    def height_m(self):
        return -float(self.body[0]["pos_ned"][2])

    def judge(self):
        state, body = self.state, self.body[0]
        now_us = self.flight.time_us
        if state.mode is not self.mode:
            self.mode, self.mode_since_us = state.mode, now_us
            self.note(f"mode {state.mode.name}")
        if not np.isfinite(body["pos_ned"]).all():
            self.fail("the position is not finite")
        if self.height_m < -UNDERGROUND_M:
            self.fail("below the ground")
        if self.was_armed and not state.is_armed and self.height_m > AIRBORNE_M:
            self.fail("motors stopped in the air")
        self.was_armed = state.is_armed
        x, y, _, _ = body["q_ned_from_frd"]
        tilt_deg = degrees(np.arccos(np.clip(1.0 - 2.0 * float(x * x + y * y), -1.0, 1.0)))
        settled = now_us - self.mode_since_us > 3_000_000
        if state.mode in BY_THRUST:
            return
        is_blind = self.fails and not self.fc.commander.has_position  # the wind drags it over the ground
        if tilt_deg > TILT_MAX_DEG and (self.mode in STEERED or is_blind) and self.height_m < AIRBORNE_M:
            raise Wrecked
        if tilt_deg > TILT_MAX_DEG and settled:
            self.fail(f"leans by {tilt_deg:.0f} deg")
        if self.mode is Mode.ALTITUDE:
            return  # only its lean is limited
        speed = hypot(float(body["vel_ned"][0]), float(body["vel_ned"][1]))
        if settled and speed > float(self.fc.params["MPC_XY_VEL_MAX"]) + SPEED_MARGIN_M_S + self.flight.config.wind_m_s:
            self.fail(f"{speed:.1f} m/s")
        if now_us - self.mode_since_us > 1_500_000:
            custom = PX4.custom_mode(state.mode)
            shown = (custom >> 16 & 0xFF, custom >> 24)
            if self.drone.px4_mode != shown:
                self.fail(f"the heartbeat shows {self.drone.px4_mode} in mode {state.mode.name}")

    def fail(self, what):
        texts = self.drone.texts[-8:]
        tail = "\n  ".join(self.log[-16:])
        raise Violation(
            f"{what} at {self.flight.time_us * 1e-6:.2f} s, {self.state.mode.name}, {self.state.landed_state.name}, "
            f"height {self.height_m:.2f} m, position {self.pos_ned.round(1)}\n  {tail}\n  {texts}"
        )

    def note(self, what):
        self.log.append(f"{self.flight.time_us * 1e-6:7.2f} {what}")

    # ---- the flight ----

    def fly(self):
        """Takes off, lives through the events, comes home."""
        try:
            self.begin()
            end_us = self.flight.time_us + int(self.seconds * 1e6)
            while self.flight.time_us < end_us:
                self.event()
                pause = self.rng.choice([0.02, 0.1, 1.0, 3.0, LEFT_ALONE])
                self.run(float(pause))
            self.come_home()
        except Wrecked:
            self.note("wrecked")
        finally:
            self.flight.close()

    def begin(self):
        self.until(lambda: self.state.is_ready_to_arm, 60.0, "ready")
        self.has_station = bool(self.rng.random() < 0.5)
        self.ask("takeoff", self.fc.request(TakeOff(self.alt(float(self.rng.uniform(3.0, 25.0))), nan)))
        self.ask("arm", self.fc.arm(force=False))
        self.run(float(self.rng.uniform(0.5, 12.0)))

    def fly_at_fence(self):
        """Flies about inside a fence until it is breached: then it stops soon enough, whatever it was doing."""
        self.set("GF_ACTION", float(self.rng.choice([2, 3, 5])))
        self.begin()
        if self.state.landed_state is LandedState.ON_GROUND:
            return
        radius_m = float(self.rng.uniform(25.0, 60.0))
        fence = [MissionItem(0, 6, 5003, (radius_m, 0.0, 0.0, 0.0), *self.place(1.0), 0.0)]
        self.fc.lists.load(ListKind.FENCE, fence)
        self.new_fence = self.new_rally = lambda: None
        self.parameter = self.station = lambda: None
        region = self.fc.fence.region
        end_us = self.flight.time_us + int(self.seconds * 1e6)
        while self.flight.time_us < end_us and not self.state.fence.breached:
            self.event()
            end_event_us = self.flight.time_us + int(float(self.rng.choice([0.1, 3.0, 10.0])) * 1e6)
            while self.flight.time_us < end_event_us and not self.state.fence.breached:
                self.frame()
        home_m = float(region.clearance(*self.state.home_ned[:2]))
        if not self.state.fence.breached or home_m < 0.0:  # a return then leads out again
            self.note(f"home {home_m:.0f} m inside the fence")
            self.flight.close()
            return
        self.note("breach")
        speed = hypot(*(float(v) for v in self.body[0]["vel_ned"][:2]))
        accel, jerk = float(self.fc.params["MPC_ACC_HOR"]), float(self.fc.params["MPC_JERK_MAX"])
        allowed_m = speed * (0.5 * speed / accel + accel / jerk + 1.0) + FENCE_MARGIN_M
        for _ in range(round(30.0 * 1e6 / FRAME_US)):
            self.frame()
            north, east, _ = self.pos_ned
            if -float(region.clearance(north, east)) > allowed_m:
                self.fail(f"{-float(region.clearance(north, east)):.1f} m beyond the fence, {allowed_m:.1f} m allowed")

    def fly_out_of_charge(self):
        """Whatever it is doing when the battery is nearly empty, soon it stands on the ground."""
        self.set("COM_LOW_BAT_ACT", float(self.rng.choice([2, 3])))
        self.parameter = lambda: None
        self.begin()
        end_us = self.flight.time_us + int(self.seconds * 1e6)
        while self.flight.time_us < end_us:
            self.event()
            self.run(float(self.rng.choice([0.02, 0.1, 1.0, 3.0])))
        self.sticks = None if self.rng.random() < 0.5 or self.sticks is None else (0.0, 0.0, 0.0, 0.0)
        if not self.state.is_armed:
            return
        self.ask("battery empty", self.fc.inject_failure(BATTERY, OFF, 0))
        seconds = 20.0 + max(self.height_m, 0.0) / 0.5
        self.until(lambda: not self.state.is_armed, seconds, "on the ground and disarmed")

    def come_home(self):
        """With healthy sensors, no fence and nobody else in control it returns, lands and disarms."""
        self.note("come home")
        for unit in SENSORS:
            self.fc.inject_failure(unit, OK, 0)
        self.sticks = self.stream = None
        self.fc.lists.load(ListKind.FENCE, [])
        self.fc.lists.load(ListKind.RALLY, [])
        self.set("RTL_LAND_DELAY", 0.0)
        self.set("RTL_TYPE", 0.0)
        self.set("NAV_DLL_ACT", 0.0)
        self.ask("speed", self.fc.request(ChangeSpeed(5.0)))
        if self.state.is_armed and self.state.landed_state is not LandedState.ON_GROUND:
            self.run(15.0)  # the estimator settles
            if self.state.is_armed:
                self.ask("return", self.fc.request(ChangeMode(Mode.RETURN)))
        self.until(lambda: not self.state.is_armed and self.height_m < AIRBORNE_M, HOME_S, "on the ground and disarmed")

    def ask(self, what, reply):
        """A request; who refuses gives a reason."""
        is_taken = reply.verdict is Verdict.ACCEPTED
        self.note(f"{what}: {'taken' if is_taken else reply.reason}")
        if not is_taken and not reply.reason:
            self.fail(f"{what} refused without a reason")
        return is_taken

    def set(self, name, value):
        self.note(f"{name} = {value:g}")
        self.fc.params.set(name, value)

    def alt(self, height_m):
        return self.flight.config.home.alt_m + height_m

    def place(self, reach_m=60.0):
        north, east = self.rng.uniform(-reach_m, reach_m, 2)
        return geodetic_from_ned(float(north), float(east), 0.0, self.flight.config.home)[:2]

    # ---- events ----

    def event(self):
        events = [
            self.choose_mode, self.choose_mode, self.choose_mode, self.command, self.command, self.command,
            self.new_mission, self.jump_in_mission, self.new_fence, self.new_rally, self.move_sticks, self.move_sticks,
            self.station, self.offboard, self.target, self.parameter,
        ]  # fmt: skip
        if self.fails:
            events += [self.fail_sensor, self.repair]
        events[int(self.rng.integers(len(events)))]()

    def choose_mode(self):
        mode = MODES[int(self.rng.integers(len(MODES)))]
        if mode in BY_THRUST:  # hands off would let it fall; that is the pilot's affair
            mode = Mode.ALTITUDE
        self.ask(f"mode {mode.name}", self.fc.request(ChangeMode(mode)))

    def command(self):
        rng, fc = self.rng, self.fc
        lat, lon = self.place()
        height_m = float(rng.choice([-20.0, 0.5, 3.0, 10.0, 20.0, 40.0]))
        speed = float(rng.choice([nan, 1.0, 5.0, 12.0]))
        what = int(rng.integers(13))
        if what == 0:
            self.ask("land", fc.request(LandAt()))
        elif what == 1:
            self.ask("land there", fc.request(LandAt(lat, lon, nan)))
        elif what == 2:
            self.ask("takeoff", fc.request(TakeOff(self.alt(height_m), nan)))
        elif what in (3, 4):
            self.ask(f"goto height {height_m}", fc.request(GoTo(lat, lon, self.alt(height_m), nan, speed)))
        elif what == 5:
            request = OrbitRequest(
                float(rng.uniform(-30, 30)), speed, int(rng.integers(6)), 0.0, lat, lon, self.alt(height_m)
            )
            self.ask(f"orbit at height {height_m}", fc.request(request))
        elif what == 6:
            self.ask("home", fc.request(SetHome(lat, lon, self.alt(float(rng.choice([0.0, 0.0, 5.0]))))))
        elif what == 7:
            self.ask("speed", fc.request(ChangeSpeed(speed, int(rng.integers(4)))))
        elif what == 8:
            is_high = self.height_m > 2.0
            if self.ask("disarm", fc.disarm(force=False)) and is_high:
                self.fail("disarmed in the air")
        elif what == 9:
            self.ask("arm", fc.arm(force=False))
        elif what == 10:
            self.ask("look", fc.guidance.look_at(195, lat, lon, nan))
        elif what == 11:
            self.ask("turn", fc.guidance.turn(90.0, 30.0, 1.0, is_relative=False))
        else:
            self.ask("guided goto", fc.request(GoTo(lat, lon, self.alt(height_m), nan, speed, mode=Mode.GUIDED)))

    def new_mission(self):
        rng = self.rng
        items = []
        for seq in range(int(rng.integers(2, 7))):
            command = int(rng.choice([16, 16, 16, 18, 19, 21, 22, 82, 178, 189, 93, 115, 20, 177]))
            params = {
                18: (1.0, 0.0, 10.0, 0.0), 19: (3.0, 0.0, 0.0, nan), 82: (0.0, 0.0, 0.0, 0.0),
                93: (2.0, -1.0, -1.0, -1.0),
                178: (1.0, float(rng.choice([2.0, 8.0])), -1.0, 0.0), 115: (90.0, 30.0, 1.0, 0.0),
                177: (float(rng.integers(0, max(seq, 1))), 2.0, 0.0, 0.0),
            }.get(command, (0.0, 0.0, 0.0, nan))  # fmt: skip
            items.append(MissionItem(seq, 6, command, params, *self.place(), float(rng.uniform(3.0, 25.0))))
        refusal = self.fc.lists.load(ListKind.MISSION, items)
        commands = [item.command for item in items]
        self.note(f"mission {commands}: {'taken' if refusal is None else refusal.reason}")
        if refusal is not None and not refusal.reason:
            self.fail("mission refused without a reason")
        if rng.random() < 0.7:
            self.ask("start mission", self.fc.request(StartMission(int(rng.integers(-1, 2)))))

    def jump_in_mission(self):
        self.ask("set current", self.fc.request(SetCurrentItem(int(self.rng.integers(5)))))

    def new_fence(self):
        radius_m = float(self.rng.choice([0.0, 30.0, 80.0]))
        kind = int(self.rng.choice([5003, 5004]))
        lat, lon = self.place(10.0 if kind == 5003 else 60.0)
        items = [MissionItem(0, 6, kind, (radius_m if kind == 5003 else 10.0, 0.0, 0.0, 0.0), lat, lon, 0.0)]
        self.note(f"fence {kind} {radius_m}: {self.fc.lists.load(ListKind.FENCE, items if radius_m else [])}")

    def new_rally(self):
        height_m = float(self.rng.choice([-10.0, 10.0, 200.0]))
        items = [MissionItem(0, 3, 5100, (0.0, 0.0, 0.0, 0.0), *self.place(), height_m)]
        self.note(f"rally {height_m}: {self.fc.lists.load(ListKind.RALLY, items)}")

    def move_sticks(self):
        kind = self.rng.random()
        if kind < 0.35:
            self.sticks = None
        elif kind < 0.55:
            self.sticks = (0.0, 0.0, 0.0, 0.0)
        else:
            self.sticks = tuple(float(axis) for axis in self.rng.choice([-1.0, -0.5, 0.0, 0.0, 0.5, 1.0], 4))
        self.note(f"sticks {self.sticks}")

    def station(self):
        self.has_station = not self.has_station
        self.note(f"station {self.has_station}")

    def offboard(self):
        if self.stream is not None and self.rng.random() < 0.4:
            self.stream = None
        else:
            north, east = (float(axis) for axis in self.rng.uniform(-30.0, 30.0, 2))
            down = -float(self.rng.choice([3.0, 15.0]))
            place, free = (north, east, down), (nan, nan, nan)
            moving = OffboardSetpoint(0, int(SETPOINT_TRAJECTORY), vel_ned=(0.2 * north, 0.2 * east, 0.1 * down))
            still = OffboardSetpoint(0, int(SETPOINT_TRAJECTORY), pos_ned=place, vel_ned=free, yaw=0.0)
            self.stream = moving if self.rng.random() < 0.4 else still
            self.run(0.3)
            self.ask("offboard", self.fc.request(ChangeMode(Mode.OFFBOARD)))
        self.note(f"stream {self.stream}")

    def target(self):
        self.has_target = not self.has_target
        self.note(f"target {self.has_target}")

    def parameter(self):
        name = str(self.rng.choice(sorted(CHOICES)))
        self.set(name, float(self.rng.choice(CHOICES[name])))

    def fail_sensor(self):
        unit = int(self.rng.choice(SENSORS))
        self.ask(f"unit {unit} off", self.fc.inject_failure(unit, OFF, 0))

    def repair(self):
        for unit in SENSORS:
            self.fc.inject_failure(unit, OK, 0)
        self.note("repaired")
