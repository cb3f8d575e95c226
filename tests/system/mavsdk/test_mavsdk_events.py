"""MAVSDK 4.1's Events and ComponentMetadata plugins: arming checks come as events, and their texts by files."""

import json
import re

import pytest
from mavsdk.plugins.action import Action
from mavsdk.plugins.component_metadata import ComponentMetadata, MetadataType
from mavsdk.plugins.events import Events

from mission.flight import FlightConfig
from tests.system.raw_vehicle import OPEN, RawVehicle

AUTOPILOT = 1


@pytest.fixture(scope="module")
def vehicle(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))  # or files of an earlier test are taken
        with RawVehicle(FlightConfig(world=OPEN, parameters={"MAV_EVENTS": 1})) as vehicle:
            yield vehicle


def test_parameters_are_described(vehicle):
    metadata, found = vehicle.plugin(ComponentMetadata), {}
    metadata.subscribe_metadata_available(lambda update, _: found.update({update.type: update.json_metadata}))
    metadata.request_autopilot_component()
    vehicle.until(lambda: {MetadataType.PARAMETER, MetadataType.EVENTS} <= set(found), 60.0, "described")
    parameters = {each["name"]: each for each in json.loads(found[MetadataType.PARAMETER])["parameters"]}
    assert len(parameters) == len(vehicle.flight.params)
    assert parameters["MIS_TAKEOFF_ALT"]["units"] == "m"
    kept = metadata.get_metadata(AUTOPILOT, MetadataType.EVENTS).json_metadata
    assert json.loads(kept) == json.loads(found[MetadataType.EVENTS])


def test_arming_checks_and_events_have_texts(vehicle):
    events, reported, reports = vehicle.plugin(Events), [], []
    events.subscribe_events(lambda event, _: reported.append((event.event_name, event.message)))
    # asking for the report instead races MAVSDK's own thread, which writes it without a lock
    events.subscribe_health_and_arming_checks(lambda report, _: reports.append(report))
    vehicle.until(lambda: vehicle.state.is_ready_to_arm, 30.0, "ready")
    vehicle.until(lambda: reports and not reports[-1].all_problems, 60.0, "reported as ready")
    report = reports[-1]
    assert report.current_mode_intention.mode_name == "Hold"
    assert report.current_mode_intention.can_arm_or_run
    assert {"gps", "battery", "imu"} <= {each.name for each in report.health_components}
    assert not any(each.has_error for each in report.health_components)

    vehicle.flight.params.set("COM_POS_FS_EPH", 0.5)  # less than the receiver can give
    vehicle.until(lambda: not vehicle.state.is_ready_to_arm, 5.0, "too inaccurate")
    vehicle.until(lambda: reports[-1].all_problems, 10.0, "reported as too inaccurate")
    report = reports[-1]
    assert not report.current_mode_intention.can_arm_or_run
    problem = report.current_mode_intention.problems[0]
    assert re.fullmatch(r"Estimator: horizontal accuracy 0\.\d m, 0\.5 m needed", problem.message)
    assert problem.health_component == "local_position_estimate"
    assert [each.name for each in report.health_components if each.has_error] == ["local_position_estimate"]

    vehicle.flight.params.set("COM_POS_FS_EPH", 5.0)
    vehicle.until(lambda: vehicle.state.is_ready_to_arm, 5.0, "ready again")
    vehicle.plugin(Action).arm()
    vehicle.until(lambda: ("armed", "Armed") in reported, 10.0, "told as armed")
    vehicle.plugin(Action).takeoff()
    vehicle.until(lambda: ("mode_changed", "Mode: Takeoff") in reported, 10.0, "told of the mode")
