"""A pilot's sticks over MAVLink in lockstep: what PX4's and ArduPilot's tests ask of the modes flown so.

Distances are judged in truth where a comment does not say otherwise.
"""

from math import degrees, hypot

import numpy as np
import pytest

from autopilot.interface.client_requests import ChangeMode
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from mission.client import Client, CommandRefused
from mission.flight import Flight, FlightConfig
from sim.faults import set_fault
from sim.world.world import WorldConfig

MAIN_MODES = {
    Mode.MANUAL: 1, Mode.ALTITUDE: 2, Mode.POSITION: 3, Mode.ACRO: 5, Mode.OFFBOARD: 6, Mode.STABILIZED: 7,
}  # fmt: skip
CMD_SET_MODE, CMD_ARM = 176, 400
RATE_HZ = 50.0
PLAIN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
FORWARD, RIGHT = 1000, 1000
MIDDLE, UP, DOWN = 500, 1000, 0  # of the throttle


class Pilot:
    """Moves the sticks of a flight's script client, from now on and until told otherwise."""

    def __init__(self, flight):
        self.flight = flight
        self.drone = flight.drone
        self.axes = {"x": 0, "y": 0, "z": MIDDLE, "r": 0}
        self.is_sending = True
        self.drone.start(self._send())

    async def _send(self):
        while True:
            if self.is_sending:
                self.drone.send("MANUAL_CONTROL", target=1, buttons=0, **self.axes)
            await self.drone.sleep(1.0 / RATE_HZ)

    def move(self, x=0, y=0, z=MIDDLE, r=0):
        self.axes = {"x": x, "y": y, "z": z, "r": r}

    async def hold(self, seconds, **axes):
        """Holds the sticks there for a while."""
        self.move(**axes)
        await self.drone.sleep(seconds)

    async def mode(self, mode):
        await self.drone.sleep(0.1)
        await self.drone.command(CMD_SET_MODE, 1.0, MAIN_MODES[mode], name="mode")

    async def land(self, timeout_s=90.0):
        """Throttle down, hands off the rest, until it has disarmed itself."""
        self.move(z=DOWN)
        await self.drone.until(lambda: not self.drone.is_armed, timeout_s, "disarmed")


def fly(script, config=None, seconds=300.0, before=None):
    """Flies `script(pilot)` to its end."""
    flight = Flight(config or FlightConfig(seed=1, world=PLAIN))
    if before is not None:
        before(flight)
    running = flight.fly(lambda _: script(Pilot(flight)), seconds=seconds)
    assert running.is_done, "the script did not end"
    if running.error is not None:
        raise running.error
    return flight


def body(flight):
    """The true state."""
    return flight.rig.rows["truth"][0]


def place(flight):
    return body(flight)["pos_ned"].copy()


def speed(flight):
    north, east, _ = body(flight)["vel_ned"]
    return hypot(north, east)


def height(flight):
    return -float(body(flight)["pos_ned"][2])


def tilt_deg(flight):
    x, y, _, _ = body(flight)["q_ned_from_frd"]
    return degrees(np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)))


async def watched(pilot, seconds, figure):
    """A figure of the flight, frame by frame, over some time."""
    end_us = pilot.drone.time_us + int(seconds * 1e6)
    values = []
    while pilot.drone.time_us < end_us:
        await pilot.drone.sleep(0.02)
        values.append(figure(pilot.flight))
    return np.array(values)


async def airborne(pilot, mode, height_m=10.0):
    """Takes off by itself, then hands over to the pilot."""
    await pilot.drone.wait_ready()
    await pilot.drone.arm()
    await pilot.drone.takeoff(height_m)
    await pilot.mode(mode)
    await pilot.drone.sleep(1.0)


@pytest.mark.parametrize("mode", [Mode.POSITION, Mode.ALTITUDE])
def test_a_pilot_takes_off_flies_and_lands(mode):
    """PX4's tests of manual control: 5 s full climb, 10 s half forward; it ends more than 5 m from home, disarmed."""
    heights = []

    async def script(pilot):
        await pilot.drone.wait_ready()
        await pilot.mode(mode)
        await pilot.drone.arm()
        await pilot.hold(5.0, z=UP)
        heights.append(height(pilot.flight))
        await pilot.hold(10.0, x=FORWARD // 2)
        heights.append(height(pilot.flight))
        await pilot.land()

    flight = fly(script)
    north, east, _ = place(flight)
    assert heights[0] > 8.0
    assert heights[1] == pytest.approx(heights[0], abs=3.0)  # it brakes its climb
    assert hypot(north, east) > 5.0
    assert flight.controller.state.mode is mode  # the pilot may arm again


def gnss_off(flight):
    set_fault(flight.rig.arrays.faults.numpy()[0], "gnss", "off")


@pytest.mark.parametrize("mode", [Mode.STABILIZED, Mode.MANUAL])
def test_stabilized_with_sticks_in_the_middle_stays_level_without_gnss(mode):
    """PX4: the tilt error stays below 6 deg."""
    tilts = []

    async def script(pilot):
        await pilot.drone.sleep(10.0)
        pilot.move(z=DOWN)
        await pilot.mode(mode)
        await pilot.drone.arm()
        await pilot.hold(3.0, z=650)
        pilot.move()
        tilts.extend(await watched(pilot, 20.0, tilt_deg))
        await pilot.hold(1.0, z=400)
        await pilot.land()

    flight = fly(script, before=gnss_off)
    assert max(tilts) < 6.0
    assert tilt_deg(flight) < 3.0


def test_stabilized_leans_and_turns_as_the_sticks_say():
    seen = {}

    async def script(pilot):
        await airborne(pilot, Mode.STABILIZED, 30.0)
        await pilot.hold(1.5, y=RIGHT // 2)
        seen["roll"] = degrees(pilot.flight.controller.state.roll_rad)
        await pilot.hold(1.5, x=FORWARD)
        seen["pitch"] = degrees(pilot.flight.controller.state.pitch_rad)
        yaw = pilot.flight.controller.state.yaw_rad
        await pilot.hold(1.0, r=1000)
        seen["yaw"] = degrees((pilot.flight.controller.state.yaw_rad - yaw) % (2 * np.pi))

    fly(script)
    assert seen["roll"] == pytest.approx(17.5, abs=1.5)
    assert seen["pitch"] == pytest.approx(-35.0, abs=2.0)
    assert seen["yaw"] == pytest.approx(150.0, abs=15.0)


def test_acro_turns_at_the_rate_the_sticks_say_and_keeps_its_attitude_without_them():
    seen = {}

    async def script(pilot):
        await airborne(pilot, Mode.ACRO, 60.0)
        await pilot.hold(0.3, y=RIGHT // 2)
        seen["rate"] = degrees(pilot.flight.controller.state.estimate.omega_frd[0])
        await pilot.hold(0.5)
        roll = pilot.flight.controller.state.roll_rad
        await pilot.hold(0.5)
        seen["drift"] = degrees(pilot.flight.controller.state.roll_rad - roll)
        await pilot.mode(Mode.POSITION)
        await pilot.hold(4.0)
        seen["speed"] = speed(pilot.flight)

    fly(script)
    assert seen["rate"] == pytest.approx(50.0, abs=5.0)
    assert abs(seen["drift"]) < 3.0
    assert seen["speed"] < 0.5


@pytest.mark.parametrize("mode", [Mode.ALTITUDE, Mode.POSITION])
def test_height_is_held_with_full_roll_and_pitch(mode):
    """ArduPilot: 9 to 11 m are kept."""
    heights = []

    async def script(pilot):
        await airborne(pilot, mode)
        for axes in ({"x": FORWARD}, {"x": -FORWARD}, {"y": RIGHT}, {"y": -RIGHT}, {"x": FORWARD, "y": RIGHT}, {}):
            pilot.move(**axes)
            heights.extend(await watched(pilot, 5.0, height))

    fly(script, FlightConfig(noise=0.0, world=PLAIN))
    assert min(heights) > 9.0
    assert max(heights) < 11.0


def test_position_is_held_after_a_dash():
    """ArduPilot: after 50 m at full stick, 10 s within 5 m of altitude and position."""
    places = []

    async def script(pilot):
        await airborne(pilot, Mode.POSITION)
        start = place(pilot.flight)
        pilot.move(x=FORWARD)
        await pilot.drone.until(lambda: np.hypot(*(place(pilot.flight) - start)[:2]) > 50.0, 20.0, "dash")
        await pilot.hold(5.0)
        places.extend(await watched(pilot, 10.0, place))

    fly(script)
    away = np.array(places) - places[0]
    assert np.abs(away).max() < 1.0


def test_brake_stops_a_vehicle_whose_stick_is_held():
    """ArduPilot: from more than 5 m/s to less than 1 m/s."""
    speeds = []

    async def script(pilot):
        await airborne(pilot, Mode.POSITION)
        pilot.move(x=FORWARD)
        await pilot.drone.sleep(6.0)
        speeds.append(speed(pilot.flight))
        assert pilot.flight.controller.request(ChangeMode(Mode.BRAKE)).verdict == 0
        await pilot.drone.sleep(5.0)
        speeds.extend(await watched(pilot, 5.0, speed))

    fly(script)
    assert speeds[0] > 5.0
    assert max(speeds[1:]) < 1.0


CMD_RETURN, CMD_LAND, CMD_INJECT_FAILURE = 20, 21, 420
RC_SIGNAL = 104.0  # FAILURE_UNIT
REPAIRED, OFF, STUCK = 0.0, 1.0, 2.0  # FAILURE_TYPE
MAIN_AUTO, RTL = 4, 5


def test_offboard_attitude_needs_no_position():
    """PX4: thrust 0.8 up to 10 m, pitch -20 deg for 3 s, roll and pitch within 5 deg; it lands and disarms."""
    seen = {}

    async def script(pilot):
        drone, state = pilot.drone, pilot.flight.controller.state
        pilot.is_sending = False
        await drone.sleep(10.0)
        level = (1.0, 0.0, 0.0, 0.0)
        drone.offboard_attitude(level, 0.1)
        await drone.start_offboard()
        await drone.arm()
        drone.offboard_attitude(level, 0.8)
        await drone.until(lambda: height(pilot.flight) > 10.0, 20.0, "10 m")
        hover, half = pilot.flight.params["MPC_THR_HOVER"], np.radians(-10.0)
        drone.offboard_attitude((np.cos(half), 0.0, np.sin(half), 0.0), hover / np.cos(2.0 * half))
        await drone.sleep(3.0)
        seen["roll"], seen["pitch"] = degrees(state.roll_rad), degrees(state.pitch_rad)
        await drone.command(CMD_LAND, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, name="land")
        await drone.until(lambda: not drone.is_armed, 120.0, "disarmed")

    fly(script, before=gnss_off)
    assert seen["roll"] == pytest.approx(0.0, abs=5.0)
    assert seen["pitch"] == pytest.approx(-20.0, abs=5.0)


@pytest.mark.parametrize("mode", [Mode.POSITION, Mode.ALTITUDE, Mode.STABILIZED, Mode.ACRO])
def test_a_vehicle_whose_pilot_falls_silent_comes_home(mode):
    """ArduPilot: throttle failsafe; recovery does not change the mode back."""

    async def script(pilot):
        await airborne(pilot, mode, 20.0)
        await pilot.hold(1.5, x=FORWARD // 3)
        pilot.is_sending = False
        await pilot.drone.until(lambda: pilot.drone.px4_mode == (MAIN_AUTO, RTL), 8.0, "return")
        pilot.is_sending = True
        pilot.move()
        await pilot.drone.sleep(3.0)
        assert pilot.drone.px4_mode == (MAIN_AUTO, RTL)
        await pilot.drone.until(lambda: not pilot.drone.is_armed, 180.0, "disarmed")

    flight = fly(script)
    assert np.hypot(*place(flight)[:2]) < 3.0
    assert any("Sticks lost: return" in text for text in flight.drone.texts)


def test_a_failure_of_the_radio_can_be_injected_and_repaired():
    async def script(pilot):
        await airborne(pilot, Mode.POSITION, 20.0)
        await pilot.drone.command(CMD_INJECT_FAILURE, RC_SIGNAL, OFF, name="fail")
        await pilot.drone.until(lambda: pilot.drone.px4_mode == (MAIN_AUTO, RTL), 8.0, "return")
        await pilot.drone.command(CMD_INJECT_FAILURE, RC_SIGNAL, REPAIRED, name="repair")
        await pilot.drone.sleep(0.5)
        await pilot.mode(Mode.POSITION)
        with pytest.raises(CommandRefused, match="can be off or on"):
            await pilot.drone.command(CMD_INJECT_FAILURE, RC_SIGNAL, STUCK, name="stick")

    fly(script, FlightConfig(world=PLAIN, parameters={"SYS_FAILURE_EN": 1}))


def test_moving_a_stick_takes_over_from_a_return():
    async def script(pilot):
        await airborne(pilot, Mode.POSITION, 20.0)
        await pilot.hold(8.0, x=FORWARD)
        await pilot.hold(3.0)
        await pilot.drone.command(CMD_RETURN, name="return")
        await pilot.hold(2.0)
        assert pilot.drone.px4_mode == (MAIN_AUTO, RTL)
        await pilot.hold(0.5, r=300)
        assert pilot.drone.px4_mode[0] == MAIN_MODES[Mode.POSITION]

    fly(script)


def test_a_stick_mode_needs_sticks():
    async def script(pilot):
        pilot.is_sending = False
        await pilot.drone.wait_ready()
        with pytest.raises(CommandRefused, match="needs a pilot's sticks"):
            await pilot.mode(Mode.POSITION)

    fly(script)


class Radio:
    """A ground station that speaks ArduPilot's dialect and overrides radio channels, as MAVProxy does."""

    def __init__(self):
        self.vehicle_end, client_end = memory_pair(LinkRole.GROUND)
        self.client = Client(client_end)
        self.flight = Flight(FlightConfig(seed=1, dialect="ardupilot", world=PLAIN), links=[self.vehicle_end])
        self.pulses = {}

    def fly(self, script, seconds=300.0):
        running = self.client.start(script(self))
        self.client.start(self._send())
        end_us = self.flight.time_us + int(seconds * 1e6)
        self.flight.run(
            lambda flight: running.is_done or flight.time_us > end_us,
            on_frame=lambda flight: self.client.frame(flight.time_us),
        )
        assert running.is_done, "the script did not end"
        if running.error is not None:
            raise running.error

    async def _send(self):
        while True:
            if self.pulses:
                channels = {f"chan{i}_raw": self.pulses.get(i, 65535) for i in range(1, 9)}
                self.client.send("RC_CHANNELS_OVERRIDE", target_system=1, target_component=1, **channels)
            await self.client.sleep(0.1)

    async def override(self, seconds, roll=1500, pitch=1500, throttle=1500, yaw=1500):
        self.pulses = {1: roll, 2: pitch, 3: throttle, 4: yaw}
        await self.client.sleep(seconds)

    async def mode(self, number):
        await self.client.command(CMD_SET_MODE, 1.0, number, name="mode")

    @property
    def mode_number(self):
        return self.client.latest("HEARTBEAT").custom_mode


def test_overridden_channels_fly_ardupilots_modes_and_lost_ones_bring_it_home():
    """Alt Hold to take off, Loiter for a 50 m dash and 10 s within 5 m, Brake with the stick held; the sticks released,
    then the radio lost."""
    alt_hold, loiter, rtl, brake = 2, 5, 6, 17
    seen = {}

    async def script(radio):
        flight, client = radio.flight, radio.client
        await client.until(lambda: flight.controller.state.is_ready_to_arm, 60.0, "ready")
        await radio.override(0.5, throttle=1000)
        await radio.mode(alt_hold)
        await client.command(CMD_ARM, 1.0, name="arm")
        await radio.override(6.0, throttle=1900)
        await radio.override(2.0)
        seen["climbed"] = height(flight)
        await radio.mode(loiter)
        start = place(flight)
        radio.pulses = {1: 1500, 2: 1000, 3: 1500, 4: 1500}  # forward is a short pulse
        await client.until(lambda: np.hypot(*(place(flight) - start)[:2]) > 50.0, 20.0, "dash")
        await radio.override(5.0)
        stopped_at = place(flight)
        await radio.override(10.0)
        seen["drift"] = np.abs(place(flight) - stopped_at).max()
        await radio.override(5.0, pitch=1000)
        seen["fast"] = speed(flight)
        await radio.mode(brake)
        await client.sleep(5.0)
        seen["slow"] = speed(flight)
        await radio.mode(loiter)
        await radio.override(1.0)
        radio.pulses = dict.fromkeys(range(1, 9), 0)  # released: the simulated radio has them again
        await client.sleep(5.0)
        seen["held"] = radio.mode_number
        flight.controller.sticks.is_cut = True
        await client.sleep(1.0)
        seen["lost"] = radio.mode_number
        flight.controller.sticks.is_cut = False
        await radio.override(2.0)
        seen["back"] = radio.mode_number
        await client.until(lambda: not flight.controller.state.is_armed, 180.0, "disarmed")

    radio = Radio()
    radio.fly(script)
    assert seen["climbed"] > 8.0
    assert seen["drift"] < 1.0
    assert seen["fast"] > 5.0
    assert seen["slow"] < 1.0
    assert (seen["held"], seen["lost"], seen["back"]) == (loiter, rtl, rtl)
    assert np.hypot(*place(radio.flight)[:2]) < 3.0
