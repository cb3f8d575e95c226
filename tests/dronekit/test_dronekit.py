"""dronekit 2.9.2 with a vehicle in ArduPilot's dialect: what its own tests ask of an ArduPilot. `make test-dronekit`

The tests follow one another, on one vehicle, each with a connection of its own.
"""

import pytest

from tests.dronekit.vehicle import HOME, Vehicle, dronekit, until

Command, VehicleMode, Location = dronekit.Command, dronekit.VehicleMode, dronekit.LocationGlobalRelative
GLOBAL, RELATIVE = 0, 3
WAYPOINT, TAKEOFF, CONDITION_YAW = 16, 22, 115


@pytest.fixture(scope="module")
def process(tmp_path_factory):
    with Vehicle(tmp_path_factory.mktemp("dronekit")) as process:
        yield process


@pytest.fixture
def vehicle(process):
    vehicle = process.connect(wait_ready=True, timeout=60)
    yield vehicle
    vehicle.close()


def download(vehicle):
    vehicle.commands.download()
    vehicle.commands.wait_ready(timeout=60)
    return vehicle.commands


def item(command, lat=0.0, lon=0.0, alt=0.0, frame=RELATIVE, params=(0.0, 0.0, 0.0, 0.0)):
    return Command(0, 0, 0, frame, command, 0, 1, *params, lat, lon, alt)


def set_mode(vehicle, name):
    vehicle.mode = VehicleMode(name)
    until(lambda: vehicle.mode.name == name)


def test_connects_without_waiting_and_finds_the_autopilot(process):
    vehicle = process.connect(wait_ready=False)
    until(lambda: vehicle.last_heartbeat is not None and vehicle._vehicle_type is not None)
    assert vehicle._vehicle_type == 2
    assert vehicle._autopilot_type == 3
    vehicle.close()


def test_attributes_are_filled(vehicle):
    for name in (
        "attitude",
        "battery",
        "gps_0",
        "location",
        "velocity",
        "groundspeed",
        "airspeed",
        "heading",
        "version",
    ):
        assert getattr(vehicle, name) is not None, name
    assert isinstance(vehicle.mode, VehicleMode)
    assert vehicle.system_status.state in ("STANDBY", "ACTIVE")
    assert vehicle.battery.voltage > 10.0
    assert vehicle.version.autopilot_type == 3
    until(lambda: vehicle.version.release_type() is not None)  # asked for after the first heartbeats
    assert vehicle.capabilities.param_float
    assert vehicle.capabilities.set_attitude_target
    assert vehicle.capabilities.command_int
    until(lambda: vehicle.is_armable)
    assert vehicle.gps_0.fix_type >= 3
    assert vehicle.ekf_ok


def test_an_attribute_set_up_late_is_filled(process):
    vehicle = process.connect(wait_ready=False, _initialize=False)
    assert vehicle.battery is None
    vehicle.initialize()
    vehicle.wait_ready("battery", timeout=60)
    assert vehicle.battery is not None
    vehicle.close()


def test_home_comes_with_the_empty_mission(vehicle):
    commands = download(vehicle)
    assert len(commands) == 0
    home = vehicle.home_location
    assert (home.lat, home.lon, home.alt) == pytest.approx(HOME, abs=0.5)


def test_an_empty_mission_is_cleared_and_uploaded(vehicle):
    vehicle.commands.clear()
    vehicle.commands.upload(timeout=60)
    assert len(download(vehicle)) == 0


def test_mission_goes_up_and_comes_back(vehicle):
    commands = download(vehicle)
    home = vehicle.home_location
    commands.clear()
    lat, lon, _ = HOME
    sent = [item(WAYPOINT, lat, lon, 747.0, GLOBAL), item(TAKEOFF, lat, lon, 100.0)]
    sent += [item(WAYPOINT, lat + 1e-3 * i, lon, 100.0) for i in range(1, 4)]
    sent.append(item(CONDITION_YAW, params=(2.0, 22.0, 1.0, 0.0)))
    for each in sent:
        commands.add(each)
    commands.upload(timeout=60)
    commands = download(vehicle)
    assert [each.command for each in commands] == [each.command for each in sent]
    assert [each.seq for each in commands[2:5]] == [3, 4, 5]
    assert commands[2].x == pytest.approx(lat + 1e-3, abs=1e-5)
    assert vehicle.home_location.lat == home.lat
    commands.next = 3
    until(lambda: commands.next == 3)


def test_flush_uploads(vehicle):
    commands = download(vehicle)
    commands.clear()
    commands.upload(timeout=60)
    assert len(download(vehicle)) == 0
    vehicle.commands.add(item(WAYPOINT, HOME[0] + 1e-3, HOME[1], 10.0))
    vehicle.flush()
    assert len(download(vehicle)) == 1


def test_home_is_set(vehicle):
    download(vehicle)
    vehicle.home_location = dronekit.LocationGlobal(-35.0, 149.0, 600.0)
    until(lambda: download(vehicle) is not None and vehicle.home_location.lat == -35.0)
    home = vehicle.home_location
    assert (home.lat, home.lon, home.alt) == (-35.0, 149.0, 600.0)
    vehicle.home_location = dronekit.LocationGlobal(*HOME)
    until(lambda: download(vehicle) is not None and vehicle.home_location.lat == pytest.approx(HOME[0], abs=1e-5))


def test_parameters_are_read_listed_set_and_heard(vehicle):
    assert vehicle.parameters.get("RTL_ALT", wait_ready=True) is not None
    assert vehicle.parameters.get("xXx_nothing_xXx", wait_ready=True) is None
    assert len(list(vehicle.parameters.items())) > 300
    heard = []
    vehicle.parameters.add_attribute_listener("RTL_ALT", lambda _, name, value: heard.append((name, value)))
    vehicle.parameters["RTL_ALT"] = 2300.0
    until(lambda: ("RTL_ALT", 2300.0) in heard)
    vehicle.parameters["RTL_ALT"] = 1500.0
    until(lambda: vehicle.parameters["RTL_ALT"] == 1500.0)


@pytest.mark.parametrize(
    "name", ["STABILIZE", "ALT_HOLD", "ACRO", "POSHOLD", "RTL", "LAND", "CIRCLE", "BRAKE", "GUIDED"]
)
def test_mode_is_chosen_on_the_ground(vehicle, name):
    set_mode(vehicle, name)


def test_channels_are_overridden_and_go_back_to_the_radio(vehicle):
    heard = []

    @vehicle.on_message("RC_CHANNELS")
    def listener(_, __, message):
        heard[:] = [message.chan1_raw, message.chan2_raw, message.chan3_raw]

    until(lambda: heard == [1500, 1500, 1000])
    vehicle.channels.overrides = {"1": 1010, "2": 1020}
    until(lambda: heard == [1010, 1020, 1000])
    del vehicle.channels.overrides["1"]
    until(lambda: heard == [1500, 1020, 1000])
    vehicle.channels.overrides = {}
    until(lambda: heard == [1500, 1500, 1000])


def test_calibrations_are_accepted(vehicle):
    results, texts = [], []
    vehicle.add_message_listener("COMMAND_ACK", lambda _, __, ack: results.append(ack.result))
    vehicle.add_message_listener("STATUSTEXT", lambda _, __, message: texts.append(message.text))
    for name, start in (("gyro", vehicle.send_calibrate_gyro), ("baro", vehicle.send_calibrate_barometer)):
        results.clear()
        start()
        until(lambda: 0 in results)
        until(lambda name=name: f"[cal] calibration done: {name}" in texts)


def test_messages_are_listened_to_and_made(vehicle):
    heard = []

    @vehicle.on_message("SYS_STATUS")
    def listener(_, name, message):
        heard.append((name, message.get_type()))

    until(lambda: ("SYS_STATUS", "SYS_STATUS") in heard)
    sent = vehicle.message_factory.command_long_encode(0, 0, 410, 0, 0, 0, 0, 0, 0, 0, 0)  # GET_HOME_POSITION
    vehicle.send_mavlink(sent)


def arm_and_take_off(vehicle, height_m):
    until(lambda: vehicle.is_armable)
    set_mode(vehicle, "GUIDED")
    vehicle.armed = True
    until(lambda: vehicle.armed)
    vehicle.simple_takeoff(height_m)
    until(lambda: vehicle.location.global_relative_frame.alt >= 0.95 * height_m)
    assert vehicle.mode.name == "GUIDED"


def test_simple_goto(vehicle):
    places = []
    vehicle.add_attribute_listener("location", lambda _, __, place: places.append(place.global_relative_frame))
    arm_and_take_off(vehicle, 10.0)
    lat, lon, _ = HOME
    vehicle.airspeed = 5.0
    vehicle.simple_goto(Location(lat + 3e-4, lon, 15.0))
    until(lambda: abs(vehicle.location.global_relative_frame.lat - lat - 3e-4) < 2e-5)
    vehicle.simple_goto(Location(lat, lon + 2e-4, 12.0), groundspeed=4.0)
    until(lambda: abs(vehicle.location.global_relative_frame.lon - lon - 2e-4) < 2e-5)
    assert vehicle.location.local_frame.down == pytest.approx(-12.0, abs=2.0)
    assert places
    set_mode(vehicle, "RTL")
    until(lambda: not vehicle.armed, 120.0)
    assert vehicle.mode.name == "RTL"


def test_arming_is_refused_in_a_mode_that_cannot_take_off(vehicle):
    set_mode(vehicle, "LAND")
    texts = []
    vehicle.add_message_listener("STATUSTEXT", lambda _, __, message: texts.append(message.text))
    vehicle.armed = True
    until(lambda: any("Mode not armable" in str(text) for text in texts))
    assert not vehicle.armed


def test_mission_is_flown(vehicle):
    commands = download(vehicle)
    commands.clear()
    lat, lon, _ = HOME
    for each in (
        item(TAKEOFF, alt=8.0),
        item(WAYPOINT, lat + 2e-4, lon, 8.0),
        item(WAYPOINT, lat + 2e-4, lon + 2e-4, 8.0),
    ):
        commands.add(each)
    commands.add(item(20))  # return
    commands.upload(timeout=60)
    set_mode(vehicle, "GUIDED")
    vehicle.armed = True
    until(lambda: vehicle.armed)
    vehicle.simple_takeoff(8.0)
    until(lambda: vehicle.location.global_relative_frame.alt > 7.0)
    commands.next = 0
    set_mode(vehicle, "AUTO")
    until(lambda: vehicle.commands.next == 3)
    until(lambda: not vehicle.armed, 120.0)


def test_reboot(vehicle):
    vehicle.reboot()
    until(lambda: vehicle.last_heartbeat < 1.0)
    until(lambda: vehicle.is_armable)
    assert not vehicle.armed
