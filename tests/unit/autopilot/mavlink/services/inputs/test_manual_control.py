"""MANUAL_CONTROL and RC_CHANNELS_OVERRIDE in, RC_CHANNELS and MANUAL_CONTROL out."""

import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.vehicles.multirotor.modes import MULTIROTOR_MODES
from tests.unit.autopilot.mavlink.rig import AskedVehicle, Client, Rig, texts

RC_RECEIVER = 65536  # MAV_SYS_STATUS_SENSOR
SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 511, 512
IDS = {"SYS_STATUS": 1, "RC_CHANNELS_RAW": 35, "RC_CHANNELS": 65, "MANUAL_CONTROL": 69}
LEAVE = 65535


def sticks_of(rig):
    now = rig.vehicle.sticks.input
    return now.roll, now.pitch, now.yaw, now.throttle


def request(rig, name):
    rig.client.command(REQUEST_MESSAGE, IDS[name])
    return rig.all(name)[0]  # it may be due in this frame anyway


def override(rig, **channels):
    values = {f"chan{i}_raw": LEAVE if i <= 8 else 0 for i in range(1, 19)} | channels
    rig.client.send("RC_CHANNELS_OVERRIDE", target_component=1, **values)
    rig.frame()


def manual(rig, **fields):
    rig.client.send("MANUAL_CONTROL", **({"target": 1, "x": 0, "y": 0, "z": 500, "r": 0, "buttons": 0} | fields))
    rig.frame()


def radio_rig():
    rig = Rig()
    rig.frame(200)  # the rig's own joystick falls silent
    rig.vehicle.params.set("COM_RC_IN_MODE", 0)
    return rig


def test_a_joystick_moves_the_sticks():
    rig = Rig()
    manual(rig, x=500, y=-250, z=750, r=1000)
    assert sticks_of(rig) == (-0.25, 0.5, 1.0, 0.5)


def test_values_out_of_range_are_bounded_and_those_left_out_stay():
    rig = Rig()
    manual(rig, x=100, y=5000, z=-400, r=-2000)
    manual(rig, x=32767, y=32767, z=32767, r=0)
    assert sticks_of(rig) == (1.0, 0.1, 0.0, -1.0)


def test_a_joystick_for_another_vehicle_is_not_ours():
    rig = Rig()
    manual(rig, target=2, x=1000)
    assert sticks_of(rig) == (0.0, 0.0, 0.0, 0.0)


def test_overridden_channels_move_the_sticks():
    rig = radio_rig()
    override(rig, chan1_raw=2000, chan2_raw=2000, chan3_raw=1000, chan4_raw=1500)
    assert sticks_of(rig) == (1.0, 1.0, 0.0, -1.0)


def test_zero_releases_the_first_eight_channels_and_leaves_the_others():
    rig = radio_rig()
    channels = rig.vehicle.sticks.input.channels
    override(rig, chan1_raw=1600, chan9_raw=1700)
    override(rig, chan1_raw=0, chan9_raw=0)
    assert (channels[0], channels[8]) == (0, 1700)


def test_the_largest_value_leaves_a_channel_and_the_one_below_releases_the_others():
    rig = radio_rig()
    channels = rig.vehicle.sticks.input.channels
    override(rig, chan1_raw=1600, chan9_raw=1700)
    override(rig, chan1_raw=65535, chan9_raw=65535)
    assert (channels[0], channels[8]) == (1600, 1700)
    override(rig, chan9_raw=65534)
    assert channels[8] == 0


def test_sticks_that_do_not_count_are_told_so_once():
    rig = Rig()
    rig.client.send("RC_CHANNELS_OVERRIDE", target_component=1, chan1_raw=1500)
    rig.client.send("RC_CHANNELS_OVERRIDE", target_component=1, chan1_raw=1500)
    assert texts(rig.frame()) == ["Sticks: COM_RC_IN_MODE 1 does not take a radio"]


def test_telemetry_shows_the_sticks_and_the_channels_they_would_be():
    rig = Rig()
    manual(rig, x=1000, y=-1000, z=500, r=500)
    fields = request(rig, "MANUAL_CONTROL")
    assert (fields.x, fields.y, fields.z, fields.r) == (1000, -1000, 500, 500)
    fields = request(rig, "RC_CHANNELS")
    assert (fields.chancount, fields.rssi) == (4, 100)
    assert (fields.chan1_raw, fields.chan2_raw, fields.chan3_raw, fields.chan4_raw) == (1000, 2000, 1500, 1755)
    assert fields.chan5_raw == 65535
    assert request(rig, "RC_CHANNELS_RAW").chan2_raw == 2000


@pytest.mark.parametrize("mode", Mode)
def test_heartbeat_tells_modes_flown_by_sticks_from_those_that_fly_themselves(mode):
    rig = Rig()
    rig.update(mode=mode)
    by_hand, by_itself = 64, 4  # MAV_MODE_FLAG: manual input, auto
    needs_sticks = MULTIROTOR_MODES[mode].needs_sticks
    base_mode = rig.all("HEARTBEAT", 60)[-1].base_mode
    assert bool(base_mode & by_hand) is needs_sticks
    assert bool(base_mode & by_itself) is not needs_sticks


def test_status_has_a_radio_once_sticks_were_heard():
    rig = Rig()
    rig.vehicle.sticks.input.heard_until_us = 0
    fields = request(rig, "SYS_STATUS")
    assert not fields.onboard_control_sensors_present & RC_RECEIVER
    manual(rig)
    fields = request(rig, "SYS_STATUS")
    assert fields.onboard_control_sensors_present & fields.onboard_control_sensors_health & RC_RECEIVER
    rig.frame(50)
    fields = request(rig, "SYS_STATUS")
    assert fields.onboard_control_sensors_present & RC_RECEIVER
    assert not fields.onboard_control_sensors_health & RC_RECEIVER


def test_channels_are_empty_and_the_signal_unknown_without_a_pilot():
    rig = Rig()
    now = rig.vehicle.sticks.input
    now.count, now.channels[:] = 0, [0] * 18
    fields = request(rig, "RC_CHANNELS")
    assert (fields.chancount, fields.chan1_raw, fields.rssi) == (0, 65535, 255)


def test_in_ardupilot_overrides_count_as_a_joystick_does_and_forward_is_a_short_pulse():
    vehicle = AskedVehicle()
    end, client_end = memory_pair(LinkRole.GROUND)
    server = MavlinkServer(vehicle, [end], ARDUPILOT)
    client = Client(client_end)
    client.send("RC_CHANNELS_OVERRIDE", target_component=1, chan1_raw=1500, chan2_raw=1000, chan3_raw=2000)
    server.frame(20_000_000)
    assert (vehicle.sticks.input.pitch, vehicle.sticks.input.throttle) == pytest.approx((1.0, 1.0))
    assert not vehicle.sticks.takes_over
    assert vehicle.sticks.input.steer_hold
