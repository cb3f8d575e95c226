"""What an outside autopilot tells of itself stands where our flight controller's state and estimate would."""

from math import pi

import numpy as np
import pytest

from autopilot.interface.vehicle_state import LandedState, Mode
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from common.airframe import load_airframe
from common.attitude import roll_pitch_yaw_of
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.boards.ardupilot_drone import ArduPilotDrone
from mission.boards.outside_controller import OutsideController
from mission.boards.px4_drone import Px4Drone
from mission.console.status_texts import Texts
from mission.plan.plan_file import MissionItem
from sim.bodies.vehicles import class_of
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import build_world

PLACE_NED = (30.0, -20.0, -10.0)


class Autopilot:
    """Its end of the link."""

    def __init__(self, dialect, drone_type):
        airframe = load_airframe("x500")
        vehicle = class_of(airframe).vehicle
        self.link, client = memory_pair(LinkRole.ONBOARD)
        self.drone, self.texts = drone_type(client), Texts(lambda: 0)
        air = wind_model(0.0, 270.0, 1.0, 0.0)
        self.rig = SteppedRig(
            airframe, build_world(), sensor_model(home=DEFAULT_HOME), air, home=DEFAULT_HOME, law=vehicle.law
        )
        self.shown = OutsideController(self.rig, vehicle, airframe, self.drone, dialect, DEFAULT_HOME, self.texts)
        self.time_us = 0

    def say(self, name, **fields):
        self.link.send(encode(name, 1, 1, 0, **fields))

    def frame(self):
        self.time_us += 20_000
        self.drone.frame(self.time_us)
        self.shown.frame(self.time_us)

    def asked(self):
        reader = FrameReader()
        return [decode(frame) for data in self.link.receive() for frame in reader.feed(data)]


@pytest.fixture(scope="module")
def px4():
    return Autopilot(PX4, Px4Drone)


@pytest.fixture(scope="module")
def ardupilot():
    return Autopilot(ARDUPILOT, ArduPilotDrone)


def test_its_estimate_is_on_the_axes_at_home(px4):
    lat_deg, lon_deg, alt_m = geodetic_from_ned(*PLACE_NED, DEFAULT_HOME)
    px4.say("ATTITUDE", roll=0.1, pitch=-0.2, yaw=2.0, rollspeed=0.3)
    where = {"lat": round(lat_deg * 1e7), "lon": round(lon_deg * 1e7), "alt": round(alt_m * 1e3)}
    px4.say("GLOBAL_POSITION_INT", **where, vx=100, vy=-200, vz=30)
    px4.frame()
    estimate = px4.shown.state.estimate
    assert estimate.pos_ned == pytest.approx(PLACE_NED, abs=0.02)
    assert estimate.vel_ned == pytest.approx((1.0, -2.0, 0.3))
    assert roll_pitch_yaw_of(estimate.q_ned_from_frd) == pytest.approx((0.1, -0.2, 2.0), abs=1e-6)
    assert np.allclose(px4.rig.rows["autopilot.ekf.rows"][0]["estimate"]["pos_ned"], PLACE_NED, atol=0.02)


def test_a_place_that_it_does_not_know_yet_is_none():
    peer = Autopilot(ARDUPILOT, ArduPilotDrone)
    peer.say("GLOBAL_POSITION_INT", lat=0, lon=0)
    peer.frame()
    assert peer.shown.state.estimate.pos_ned == pytest.approx((0.0, 0.0, 0.0))


def test_mode_arming_battery_and_texts(px4):
    px4.say("HEARTBEAT", type=2, autopilot=12, base_mode=128 | 1, custom_mode=4 << 16 | 4 << 24)
    px4.say("SYS_STATUS", battery_remaining=51)
    px4.say("EXTENDED_SYS_STATE", landed_state=2)
    px4.say("MISSION_CURRENT", seq=3, total=65535)
    px4.say("STATUSTEXT", severity=6, text="Takeoff detected\t")
    px4.frame()
    state = px4.shown.state
    assert (state.mode, state.is_armed, state.landed_state) == (Mode.MISSION, True, LandedState.IN_AIR)
    assert (state.battery_remaining, state.mission_current, state.mission_count) == (0.51, 3, 0)
    assert [text.text for text in px4.texts.since(0)] == ["Takeoff detected"]


def test_it_is_asked_for_what_does_not_come(ardupilot):
    ardupilot.frame()
    assert ardupilot.asked()[0].name == "HEARTBEAT"  # before its own it is asked for nothing
    ardupilot.say("HEARTBEAT", type=2, autopilot=3, base_mode=1, custom_mode=17)
    ardupilot.frame()
    asked = {message.fields.param1 for message in ardupilot.asked() if message.name == "COMMAND_LONG"}
    assert {30.0, 33.0, 193.0} <= asked  # ATTITUDE, GLOBAL_POSITION_INT, EKF_STATUS_REPORT
    assert ardupilot.shown.state.mode is Mode.BRAKE
    assert ardupilot.drone.px4_mode == (4, 3)  # a script sees Hold


def test_an_ardupilots_mission_begins_with_home(ardupilot):
    ardupilot.say("HOME_POSITION", latitude=474000000, longitude=85000000, altitude=488_000)
    ardupilot.frame()
    items = [
        MissionItem(0, 3, 22, (0.0, 0.0, 0.0, float("nan")), 47.4, 8.5, 10.0),
        MissionItem(1, 2, 177, (0.0, 2.0, 0.0, 0.0), 0.0, 0.0, 0.0),
    ]
    ardupilot.asked()
    running = ardupilot.drone.start(ardupilot.drone.upload(items))
    sent = []
    for seq in (None, 0, 1, 2):
        if seq is not None:
            ardupilot.say("MISSION_REQUEST_INT", seq=seq)
        ardupilot.frame()
        sent += [m.fields for m in ardupilot.asked() if m.name in ("MISSION_COUNT", "MISSION_ITEM_INT")]
    ardupilot.say("MISSION_ACK", type=0)
    ardupilot.frame()
    assert running.is_done
    assert sent[0].count == 3
    assert [(item.seq, item.command) for item in sent[1:]] == [(0, 16), (1, 22), (2, 177)]
    assert sent[2].param4 == 0.0  # NaN is refused there
    assert sent[3].param1 == 1.0  # the jump leads to the same item


def test_a_px4_that_counts_no_turns_circles_as_long_as_they_take():
    autopilot = Autopilot(PX4, Px4Drone)
    autopilot.say("HEARTBEAT", type=1, autopilot=12, base_mode=1, custom_mode=4 << 16 | 3 << 24)
    autopilot.frame()
    item = MissionItem(0, 3, 18, (2.0, 0.0, 80.0, 1.0), 47.4, 8.5, 60.0)
    running = autopilot.drone.start(autopilot.drone.upload([item]))
    autopilot.frame()
    assert [m.fields.param_id for m in autopilot.asked() if m.name == "PARAM_REQUEST_READ"] == ["FW_AIRSPD_TRIM"]
    autopilot.say("PARAM_VALUE", param_id="FW_AIRSPD_TRIM", param_value=0x41A00000, param_type=9)  # 20.0
    autopilot.frame()
    autopilot.say("MISSION_REQUEST_INT", seq=0)
    autopilot.frame()
    sent = next(m.fields for m in autopilot.asked() if m.name == "MISSION_ITEM_INT")
    assert (sent.command, sent.param3, sent.param4) == (19, 80.0, 1.0)
    assert sent.param1 == pytest.approx(2.0 * 2.0 * pi * 80.0 / 20.0)
    autopilot.say("MISSION_ACK", type=0)
    autopilot.frame()
    assert running.is_done


@pytest.mark.parametrize(("mav_type", "modes"), [(1, [1, 4]), (2, [])])
def test_a_plane_of_px4_passes_through_a_mode_that_holds_no_height_before_it_is_ready(mav_type, modes):
    autopilot = Autopilot(PX4, Px4Drone)
    custom_mode, chosen = 4 << 16 | 3 << 24, []
    running = autopilot.drone.start(autopilot.drone.wait_ready())
    for _ in range(200):
        autopilot.say("HEARTBEAT", type=mav_type, autopilot=12, base_mode=1, custom_mode=custom_mode)
        autopilot.say("SYS_STATUS", onboard_control_sensors_health=1 << 28)
        autopilot.say("HOME_POSITION", latitude=474000000, longitude=85000000)
        autopilot.frame()
        for message in autopilot.asked():
            if message.name == "COMMAND_LONG" and message.fields.command == 176:
                chosen.append(int(message.fields.param2))
                custom_mode = chosen[-1] << 16 | int(message.fields.param3) << 24
                autopilot.say("COMMAND_ACK", command=176, result=0)
    assert running.is_done
    assert running.error is None
    assert chosen == modes
