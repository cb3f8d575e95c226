import pytest

from autopilot.interface.client_requests import ChangeMode
from autopilot.interface.mode_spec import mode_table
from autopilot.interface.vehicle_state import Mode, Verdict
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.vehicles.multirotor.modes import MULTIROTOR_MODES
from tests.unit.autopilot.mavlink.rig import AskedVehicle, Rig

REQUEST, AVAILABLE, CURRENT, MONITOR = 512, 435, 436, 437
ADVANCED, NOT_SELECTABLE = 1, 2
BOTH = pytest.mark.parametrize("dialect", [PX4, ARDUPILOT], ids=lambda dialect: dialect.name)


@BOTH
def test_every_mode_is_listed_in_order_after_the_acknowledgement(dialect):
    rig = Rig(dialect=dialect)
    rig.client.command(REQUEST, AVAILABLE, 0.0)
    messages = [message for message in rig.frame() if message.name in ("COMMAND_ACK", "AVAILABLE_MODES")]
    assert messages[0].fields.result == 0
    modes = [message.fields for message in messages[1:]]
    assert [mode.mode_index for mode in modes] == list(range(1, len(dialect.modes) + 1))
    assert {mode.number_modes for mode in modes} == {len(dialect.modes)}
    assert [dialect.mode_from_custom(mode.custom_mode) for mode in modes] == [row.mode for row in dialect.modes]
    assert len({mode.mode_name for mode in modes}) == len(modes)


def test_one_mode_is_sent_by_its_index():
    rig = Rig()
    rig.client.command(REQUEST, AVAILABLE, 1.0)
    assert rig.only("AVAILABLE_MODES").mode_index == 1


def test_mode_beyond_the_last_is_denied():
    assert Rig().ack(REQUEST, AVAILABLE, 99.0).result == Verdict.DENIED


def test_modes_the_vehicle_does_not_have_are_not_listed():
    vehicle = AskedVehicle()
    vehicle.modes = mode_table(*(spec for mode, spec in MULTIROTOR_MODES.items() if mode is not Mode.ACRO))
    rig = Rig(vehicle=vehicle)
    rig.client.command(REQUEST, AVAILABLE, 0.0)
    modes = rig.all("AVAILABLE_MODES")
    assert {mode.number_modes for mode in modes} == {len(PX4.modes) - 1}
    assert "Acro" not in [mode.mode_name for mode in modes]


def test_standard_numbers_and_properties_are_told():
    rig = Rig()
    rig.client.command(REQUEST, AVAILABLE, 0.0)
    modes = {mode.mode_name: mode for mode in rig.all("AVAILABLE_MODES")}
    assert modes["Mission"].standard_mode == 6
    assert modes["Orbit"].properties == NOT_SELECTABLE
    assert modes["Offboard"].properties == ADVANCED


@BOTH
def test_current_mode_has_its_number(dialect):
    rig = Rig(dialect=dialect)
    rig.update(mode=Mode.RETURN)
    rig.client.command(REQUEST, CURRENT)
    current = rig.all("CURRENT_MODE")[-1]
    assert (current.standard_mode, current.custom_mode) == (5, dialect.custom_mode(Mode.RETURN))
    assert current.intended_custom_mode == current.custom_mode


def test_monitor_stays_the_same():
    rig = Rig()
    assert len({monitor.seq for monitor in rig.all("AVAILABLE_MODES_MONITOR", 600)}) == 1


def test_mode_is_chosen_by_its_standard_number():
    rig = Rig()
    assert rig.ack(262, 7.0).result == 0
    assert rig.vehicle.calls == [ChangeMode(Mode.LAND)]
    assert rig.ack(262, 3.0).result == Verdict.DENIED  # CRUISE
    assert rig.ack(262, 0.0).result == Verdict.DENIED  # none


def test_interval_is_sent_by_request_too():
    rig = Rig()
    rig.client.command(REQUEST, 244, 30.0)
    interval = rig.only("MESSAGE_INTERVAL")
    assert (interval.message_id, interval.interval_us) == (30, 50_000)
    assert rig.ack(REQUEST, 244, 9999.0).result == Verdict.UNSUPPORTED


@pytest.mark.parametrize("name", ["EKF_STATUS_REPORT", "WIND", "RANGEFINDER"])
def test_ardupilots_stations_get_their_messages_unasked(name):
    assert Rig(dialect=ARDUPILOT).all(name, 100)
    assert not Rig().all(name, 100)


def test_wind_comes_from_where_it_blows():
    wind = Rig(dialect=ARDUPILOT).all("WIND", 100)[0]
    assert wind.direction == pytest.approx(126.87, abs=0.01)  # it blows to (3, -4): from the south-east
    assert wind.speed == pytest.approx(5.0)


def test_flight_information_counts_from_power_on():
    rig = Rig()
    rig.update(armed_since_us=3_000_000, takeoff_us=4_000_000, flight_number=2)
    rig.client.command(REQUEST, 264)
    info = rig.only("FLIGHT_INFORMATION")
    assert (info.arming_time_utc, info.takeoff_time_utc, info.flight_uuid) == (3_000_000, 4_000_000, 2)
