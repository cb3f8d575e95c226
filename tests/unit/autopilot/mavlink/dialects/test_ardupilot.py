import struct

import pytest
from pymavlink import mavutil

from autopilot.interface.client_requests import ChangeMode
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects import UnknownModeError
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from tests.unit.autopilot.mavlink.rig import Rig

PYMAVLINK_NAMES = {
    Mode.HOLD: "LOITER",
    Mode.TAKEOFF: "GUIDED",
    Mode.MISSION: "AUTO",
    Mode.RETURN: "RTL",
    Mode.LAND: "LAND",
    Mode.OFFBOARD: "GUIDED",
    Mode.MANUAL: "STABILIZE",
    Mode.STABILIZED: "STABILIZE",
    Mode.ACRO: "ACRO",
    Mode.ALTITUDE: "ALT_HOLD",
    Mode.POSITION: "POSHOLD",
    Mode.PRECISION_LAND: "LAND",
    Mode.FOLLOW: "FOLLOW",
    Mode.ORBIT: "CIRCLE",
    Mode.BRAKE: "BRAKE",
    Mode.SMART_RETURN: "SMART_RTL",
    Mode.GUIDED: "GUIDED",
    Mode.TERMINATION: "LAND",
}


def as_float(value: float) -> int:
    return int(struct.unpack("<I", struct.pack("<f", value))[0])


@pytest.mark.parametrize("mode", Mode)
def test_every_mode_has_the_number_pymavlink_knows(mode):
    assert mavutil.mode_mapping_acm[ARDUPILOT.custom_mode(mode)] == PYMAVLINK_NAMES[mode]


@pytest.mark.parametrize("mode", [row.mode for row in ARDUPILOT.modes])
def test_mode_survives_the_round_trip(mode):
    assert ARDUPILOT.mode_from_custom(ARDUPILOT.custom_mode(mode)) is mode
    assert ARDUPILOT.mode_from_command(ARDUPILOT.custom_mode(mode), 99) is mode


def test_every_mode_that_can_be_asked_for_is_listed():
    own = {mode for mode in Mode if ARDUPILOT.mode_from_custom(ARDUPILOT.custom_mode(mode)) is mode}
    assert {row.mode for row in ARDUPILOT.modes} == own


def test_unknown_mode_is_refused_by_its_name():
    with pytest.raises(UnknownModeError, match="AUTOTUNE"):
        ARDUPILOT.mode_from_custom(15)
    with pytest.raises(UnknownModeError, match="1000"):
        ARDUPILOT.mode_from_custom(1000)


def test_custom_version_is_plain_text():
    assert ARDUPILOT.custom_version("Honeyguide", "0.1.0") == b"HG-0.1.0"


def test_heartbeat_is_a_copter_of_ardupilot():
    rig = Rig(dialect=ARDUPILOT)
    rig.update(mode=Mode.GUIDED)
    heartbeat = rig.all("HEARTBEAT", 60)[-1]
    assert (heartbeat.type, heartbeat.autopilot, heartbeat.custom_mode) == (2, 3, 4)
    assert heartbeat.base_mode & 1


@pytest.mark.parametrize("p1", [1.0, 29.0, 129.0])
def test_mode_is_set_by_its_number(p1):
    rig = Rig(dialect=ARDUPILOT)
    assert rig.ack(176, p1, 6.0, 0.0).result == 0
    assert rig.vehicle.calls == [ChangeMode(Mode.RETURN)]


def test_mode_is_set_by_message():
    rig = Rig(dialect=ARDUPILOT)
    rig.client.send("SET_MODE", base_mode=1, custom_mode=5)
    rig.frame()
    assert rig.vehicle.calls == [ChangeMode(Mode.HOLD)]


def test_version_tells_how_parameters_are_encoded():
    rig = Rig(dialect=ARDUPILOT)
    rig.client.command(512, 148.0)
    version = rig.only("AUTOPILOT_VERSION")
    assert version.capabilities & 131_072
    assert not version.capabilities & 16
    assert version.flight_sw_version >> 24 == 4
    assert bytes(version.flight_custom_version).startswith(b"HG-")


def test_integers_travel_as_floats():
    rig = Rig(dialect=ARDUPILOT)
    rig.client.send("PARAM_REQUEST_READ", param_id="FRAME_CLASS", param_index=-1)
    value = rig.only("PARAM_VALUE")
    assert (value.param_value, value.param_type) == (as_float(1.0), 2)


def test_takeoff_altitude_is_above_home():
    rig = Rig(dialect=ARDUPILOT)
    assert rig.ack(22, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 10.0).result == 0
    (takeoff,) = rig.vehicle.calls
    assert takeoff.alt_amsl_m == rig.vehicle.state.home.alt_m + 10.0


@pytest.mark.parametrize(("number", "result"), [(5, 0), (99, 2)])
def test_the_old_set_mode_is_acknowledged_by_its_number(number, result):
    rig = Rig(dialect=ARDUPILOT)
    rig.client.send("SET_MODE", base_mode=1, custom_mode=number)
    ack = rig.only("COMMAND_ACK")
    assert (ack.command, ack.result) == (11, result)
