"""The recipe "A vehicle class" of CONTRIBUTING.md: a sled, one line in the list, driven over MAVLink by pymavlink."""

from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink
from pymavlink.mavutil import mode_mapping_byname, mode_string_v10
from typer.testing import CliRunner

import common.airframes
from autopilot import tuning
from autopilot.commander.failsafe import POSITION_LOST
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.vehicles.multirotor.ardupilot import COPTER
from autopilot.vehicles.multirotor.modes import MULTIROTOR_MODES
from common.airframe import AIRFRAME_FOLDER, AirframeError, load_airframe
from common.geodesy import geodetic_from_ned
from mission.flight import Flight, FlightConfig
from mission.view import shapes
from mission.view.vehicle_model import VehicleModel
from sim.bodies.vehicles import VEHICLES, class_of
from sim.world.world import WorldConfig
from tests.recipes.sled_class import DRIVE, MAV_TYPE_GROUND_ROVER, SIMULATED_SLED, SLED
from tests.recipes.station import Station
from tests.unit.autopilot.kinematic import item

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED = 0, 1, 2, 3
ARM, SET_MODE, TAKEOFF = (
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
    mavlink.MAV_CMD_DO_SET_MODE,
    mavlink.MAV_CMD_NAV_TAKEOFF,
)
VELOCITY_ONLY = 0b110111000111


SLED_AIRFRAMES = Path(__file__).parent / "airframes"


@pytest.fixture
def airframe(monkeypatch):
    """The class's line in the list, its sections of airframe files, and one such file."""
    monkeypatch.setattr("sim.bodies.vehicles.VEHICLES", [*VEHICLES, SIMULATED_SLED])
    monkeypatch.setattr("common.airframes.__path__", [*common.airframes.__path__, str(SLED_AIRFRAMES)])
    return str(SLED_AIRFRAMES / "sled.toml")


class Sled:
    """A flight of the sled, and a station."""

    def __init__(self, airframe, dialect="px4"):
        vehicle_end, station_end = memory_pair(LinkRole.GROUND)
        world = WorldConfig(size_m=128.0, hill_height_m=0.0, trees_per_ha=0.0)
        self.flight = Flight(FlightConfig(airframe=airframe, world=world, dialect=dialect), links=[vehicle_end])
        self.station = Station(station_end)
        self.state = self.flight.controller.state
        commander = self.flight.controller.commander
        self.until(lambda: self.state.is_ready_to_arm and commander.has_position, 40.0)

    def run(self, seconds, velocity=None):
        for i in range(round(50 * seconds)):
            if velocity is not None and i % 5 == 0:
                self.send(
                    mavlink.MAVLink_set_position_target_local_ned_message(
                        0, 1, 1, mavlink.MAV_FRAME_LOCAL_NED, VELOCITY_ONLY, 0, 0, 0, *velocity, 0, 0, 0, 0, 0
                    )
                )
            self.flight.frame()

    def until(self, condition, seconds):
        for _ in range(round(50 * seconds)):
            if condition():
                return
            self.flight.frame()
        raise AssertionError(f"not within {seconds} s: {self.flight.controller.check_arming()}")

    def send(self, message):
        self.station.link.send(message.pack(self.station.writer))

    def ask(self, number, *params):
        """The result of a command."""
        self.station.heard.clear()
        self.station.command(number, *params)
        self.run(0.1)
        return [ack.result for ack in self.heard("COMMAND_ACK") if ack.command == number][-1]

    def goto(self, north_m):
        lat, lon, alt = geodetic_from_ned(north_m, 0.0, 0.0, self.flight.config.home)
        x, y, kind = round(lat * 1e7), round(lon * 1e7), mavlink.MAV_CMD_DO_REPOSITION
        self.station.heard.clear()
        self.send(mavlink.MAVLink_command_int_message(1, 1, 0, kind, 0, 0, -1.0, 1.0, 0.0, nan, x, y, alt))
        self.run(0.1)
        return [ack.result for ack in self.heard("COMMAND_ACK")][-1]

    def heard(self, kind):
        return [message for message in self.station.receive() if message.get_type() == kind]

    def texts(self):
        return [message.text for message in self.heard("STATUSTEXT")]

    @property
    def pos_ned(self):
        return self.flight.rig.rows["truth"]["pos_ned"][0]


def test_a_class_that_is_not_in_the_list_is_told(tmp_path):
    path = tmp_path / "sled.toml"
    path.write_text('vehicle = "sled"\n' + (AIRFRAME_FOLDER / "x500.toml").read_text())
    with pytest.raises(AirframeError, match="unknown class of vehicles 'sled'; known: multirotor"):
        class_of(load_airframe(str(path)))


def test_its_airframe_file_has_the_sections_of_its_class(airframe):
    assert load_airframe(airframe).runners.speed_m_s == 3.0
    assert Flight(FlightConfig(airframe=airframe)).params["SLED_SPEED"] == 3.0


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("[runners]\nspeed_m_s", "[wheels]\nradius_m", "runners: Field required"),
        ("[runners]", "[wheels]\n[runners]", "wheels: Extra inputs are not permitted"),
        ("value = 3.0, source", "value = 0.0, source", "empty_cell_v: Input should be greater than 0"),
        ('"sled"\n\n', '["sled"]\n\n', "vehicle: Input should be a valid string"),
        ('vehicle = "sled"', "", "rotor_model: Field required"),
    ],
)
def test_what_its_file_lacks_or_has_too_much_is_named_in_one_sentence(airframe, tmp_path, old, new, sentence):
    path, text = tmp_path / "mine.toml", Path(airframe).read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(AirframeError, match=rf"^{path}: (battery\.)?{sentence}[^\n]*$"):
        load_airframe(str(path))


def test_its_shape_is_a_plain_box_to_who_knows_no_better(airframe):
    shape = shapes.vehicle(load_airframe(airframe))
    assert len(shape.body.vertices) == 2 * 24  # a hull and a nose
    assert shape.body.vertices[:, 0].max() > -shape.body.vertices[:, 0].min()  # which shows the heading
    assert (shape.hubs.shape, shape.spins) == ((0, 3), ())
    VehicleModel(load_airframe(airframe))


def test_gains_of_a_class_that_designs_none_are_refused(airframe):
    result = CliRunner().invoke(tuning.app, ["--airframe", airframe])
    assert result.exit_code == 2
    assert "airframe 'sled': nobody designs the gains of a sled" in " ".join(result.output.split())


def test_a_sled_is_driven_over_mavlink(airframe):
    sled = Sled(airframe)
    sled.run(1.0)
    beat = next(each for each in sled.heard("HEARTBEAT") if each.autopilot == mavlink.MAV_AUTOPILOT_PX4)
    assert (beat.type, beat.custom_mode) == (MAV_TYPE_GROUND_ROVER, 4 << 16 | 3 << 24)
    assert sled.ask(TAKEOFF, 0.0, 0.0, 0.0, nan, nan, nan, nan) == UNSUPPORTED
    assert "Takeoff: no mode of this vehicle does that" in sled.texts()
    assert sled.goto(10.0) == TEMPORARILY_REJECTED  # not armed
    assert sled.ask(ARM, 1.0) == ACCEPTED
    sled.run(15.0)
    assert sled.state.is_armed  # nobody waits for a take-off
    assert np.abs(sled.pos_ned[:2]).max() < 1.0  # it stands as well as its estimate knows that it does
    assert sled.ask(SET_MODE, 1.0, 4.0, 11.0) == ACCEPTED
    assert sled.state.mode is DRIVE
    assert sled.goto(10.0) == ACCEPTED
    sled.run(20.0)
    place = sled.heard("LOCAL_POSITION_NED")[-1]
    assert (place.x, place.y) == pytest.approx((10.0, 0.0), abs=1.5)
    assert sled.pos_ned[0] == pytest.approx(10.0, abs=1.5)
    assert sled.ask(ARM, 0.0) == ACCEPTED
    assert not sled.state.is_armed
    assert sled.state.mode is Mode.HOLD


def test_setpoints_of_a_client_drive_it_and_their_loss_stops_it(airframe):
    sled = Sled(airframe)
    assert sled.ask(ARM, 1.0) == ACCEPTED
    sled.run(1.0, velocity=(-1.0, 0.0, 0.0))
    assert sled.ask(SET_MODE, 1.0, 6.0, 0.0) == ACCEPTED
    sled.run(8.0, velocity=(-1.0, 0.0, 0.0))
    assert sled.pos_ned[0] < -3.0
    sled.run(10.0)
    assert "Offboard setpoints lost: hold" in sled.texts()
    assert sled.state.mode is Mode.HOLD
    assert abs(sled.flight.rig.rows["truth"]["vel_ned"][0][0]) < 0.1


def test_it_is_armed_by_its_own_checks_besides_those_of_all(airframe):
    sled = Sled(airframe)
    sled.flight.params.set("SLED_SLOPE", -1.0)
    assert sled.ask(ARM, 1.0) == TEMPORARILY_REJECTED
    assert "the slope of 0 degrees is too steep" in " ".join(sled.texts())
    sled.flight.params.set("SLED_SLOPE", 15.0)
    assert sled.ask(ARM, 1.0) == ACCEPTED


def test_the_last_resort_of_a_sled_is_to_stop(airframe):
    sled = Sled(airframe)
    assert sled.ask(ARM, 1.0) == ACCEPTED
    assert sled.goto(30.0) == ACCEPTED
    sled.run(2.0)
    sled.flight.controller.commander.guard.act(POSITION_LOST)
    assert sled.state.mode is Mode.HOLD
    sled.run(1.0)
    assert "Position lost: hold" in sled.texts()
    assert sled.ask(mavlink.MAV_CMD_DO_FLIGHTTERMINATION, 1.0) == ACCEPTED
    assert not sled.state.is_armed


def test_what_a_sled_does_not_have_cannot_fail(airframe):
    sled = Sled(airframe)
    sled.flight.params.set("SYS_FAILURE_EN", 1)
    assert sled.ask(ARM, 1.0) == ACCEPTED
    inject, battery, motor, ok, off = mavlink.MAV_CMD_INJECT_FAILURE, 100, 101, 0, 1
    assert sled.ask(inject, battery, off) == UNSUPPORTED
    assert sled.ask(inject, battery, ok) == ACCEPTED
    assert sled.ask(inject, motor, off, 2.0) == DENIED
    assert "there are motors 1 to 1" in " ".join(sled.texts())
    assert sled.ask(inject, motor, off, 1.0) == ACCEPTED
    sled.flight.injector.charge_to(11.0)


def test_ardupilots_clients_know_its_modes_by_their_own_numbers(airframe):
    sled = Sled(airframe, dialect="ardupilot")
    assert sled.ask(ARM, 1.0) == ACCEPTED
    assert sled.ask(SET_MODE, 1.0, 15.0) == ACCEPTED
    sled.run(1.0)
    assert sled.state.mode is DRIVE
    assert 15 in [each.custom_mode for each in sled.heard("HEARTBEAT") if each.autopilot == 3]
    assert sled.goto(5.0) == ACCEPTED
    sled.run(15.0)
    assert sled.pos_ned[0] == pytest.approx(5.0, abs=1.5)


def test_ardupilots_clients_take_it_for_a_rover(airframe):
    sled = Sled(airframe, dialect="ardupilot")
    sled.run(1.1)
    beat = next(each for each in sled.heard("HEARTBEAT") if each.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)
    assert mode_string_v10(beat) == "HOLD"
    assert sled.ask(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, 0.0) == ACCEPTED
    sled.run(0.5)
    listed = {each.mode_name.upper(): each.custom_mode for each in sled.heard("AVAILABLE_MODES")}
    theirs = mode_mapping_byname(beat.type)
    assert listed == {name: theirs[name] for name in ("HOLD", "GUIDED")}
    assert sled.ask(SET_MODE, 1.0, theirs["STEERING"]) == DENIED
    assert "there is no mode STEERING" in " ".join(sled.texts())
    assert sled.ask(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION) == ACCEPTED
    (version,) = sled.heard("AUTOPILOT_VERSION")
    assert version.flight_sw_version >> 8 == 0x040603


def test_ardupilots_clients_find_a_rovers_parameters_and_none_of_a_copters(airframe):
    sled = Sled(airframe, dialect="ardupilot")
    sled.send(mavlink.MAVLink_param_set_message(1, 1, b"CRUISE_SPEED", 1.5, mavlink.MAV_PARAM_TYPE_REAL32))
    sled.run(0.1)
    assert sled.flight.params["SLED_SPEED"] == 1.5
    sled.send(mavlink.MAVLink_param_request_list_message(1, 1))
    sled.run(60.0)
    names = {each.param_id for each in sled.heard("PARAM_VALUE")}
    assert {"CRUISE_SPEED", "SLED_SPEED", "FENCE_ENABLE"} <= names
    assert not [name for name in names if name.startswith(("ATC_RAT", "ATC_ACCEL", "MOT_SPIN", "MC_PITCH"))]
    assert not [name for name in names if name.startswith(("MC_", "MPC_", "LNDMC_", "FD_ACT_", "NAV_MC_"))]
    assert names.isdisjoint({each.name for each in (*COPTER.aliases, *COPTER.constants)})


def test_a_class_that_never_leaves_the_ground_has_no_modes_and_no_mission_items_that_do(airframe):
    with pytest.raises(ValueError, match="sled: mode LAND takes off or lands, and the class has no `ground`"):
        replace(SLED, modes=MULTIROTOR_MODES)
    mission = Sled(airframe).flight.controller.navigator.mission
    for command in (mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_LAND):
        refusal = mission.load([item(0, mavlink.MAV_CMD_NAV_WAYPOINT, 10.0), item(1, command, 20.0)])
        assert (refusal.seq, refusal.result) == (1, mavlink.MAV_MISSION_UNSUPPORTED)
        assert "vehicles that leave the ground" in refusal.reason
    assert mission.load([item(0, mavlink.MAV_CMD_NAV_WAYPOINT, 10.0)]) is None


@pytest.mark.parametrize("dialect", ["px4", "ardupilot"])
def test_no_command_of_a_multirotors_stops_the_drive(airframe, dialect):
    sled = Sled(airframe, dialect)
    numbers = sorted(sled.flight.server.command_handlers())
    for number in numbers:
        for value in (0.0, 1.0, nan):
            if not sled.state.is_armed:
                sled.flight.controller.arm(force=True)
            sled.station.command(number, *[value] * 7)
            sled.run(0.06)
    assert {ack.command for ack in sled.heard("COMMAND_ACK")} == set(numbers)
