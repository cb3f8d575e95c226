"""SR0_*: rates of groups of messages as parameters."""

import pytest

from autopilot.ardupilot_only_params import ARDUPILOT_PARAMETERS, STREAM_GROUPS
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.params import parameter_table
from tests.unit.autopilot.mavlink.rig import AskedVehicle, Rig


def rig_with(**values):
    vehicle = AskedVehicle()
    vehicle.params = parameter_table(None, ARDUPILOT_PARAMETERS)
    for name, value in values.items():
        vehicle.params.set(name, value)
    return Rig(dialect=ARDUPILOT, vehicle=vehicle)


def count(rig, name):
    return len(rig.all(name, 200))


def test_a_rate_holds_from_power_on():
    assert count(rig_with(SR0_EXTRA1=2), "ATTITUDE") == pytest.approx(8, abs=1)


def test_a_rate_is_changed_stopped_and_given_back():
    rig = rig_with()
    own = count(rig, "ATTITUDE")
    for rate, messages in ((5, 20), (0, 0), (-1, own)):
        rig.vehicle.params.set("SR0_EXTRA1", rate)
        assert count(rig, "ATTITUDE") == pytest.approx(messages, abs=1)


def test_other_groups_keep_their_rates():
    rig = rig_with(SR0_EXTRA1=0)
    assert count(rig, "VFR_HUD") == pytest.approx(16, abs=1)


def test_every_group_has_messages():
    rig = rig_with()
    assert all(rig.server._endpoint.telemetry.group_ids(group) for group in STREAM_GROUPS.values())
