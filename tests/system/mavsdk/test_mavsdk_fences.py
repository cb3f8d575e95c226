"""MAVSDK 4.1's Geofence and MissionRaw plugins against the vehicle's fence and rally points."""

import pytest
from mavsdk import ComponentType, Configuration, ConnectionResult, Mavsdk
from mavsdk.plugins.geofence import (
    Circle,
    FenceType,
    Geofence,
    GeofenceData,
    GeofenceError,
    Point,
    Polygon,
)
from mavsdk.plugins.mission_raw import MissionItem as RawItem
from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError, MissionRawResult

from autopilot.interface.item_lists import ListKind
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.flight import FlightConfig
from tests.system.raw_vehicle import OPEN, RawVehicle
from tests.system.vehicle import IdleVehicle

SQUARE = ((-50.0, -50.0), (-50.0, 50.0), (50.0, 50.0), (50.0, -50.0))
START_UP_S = 120.0  # wall clock, with the kernels to compile on a busy machine


@pytest.fixture(scope="module")
def vehicle():
    with RawVehicle(FlightConfig(world=OPEN)) as vehicle:
        yield vehicle


def place(north, east):
    return geodetic_from_ned(north, east, 0.0, DEFAULT_HOME)[:2]


def square(points=SQUARE):
    return Polygon([Point(*place(*point)) for point in points], FenceType.INCLUSION)


def raw_items(mission_type, rows):
    return [
        RawItem(seq, frame, command, int(seq == 0), 1, p1, 0.0, 0.0, 0.0,
                *(round(degrees * 1e7) for degrees in place(*point)), height, mission_type)
        for seq, (frame, command, p1, point, height) in enumerate(rows)
    ]  # fmt: skip


def stored(vehicle, kind):
    return vehicle.flight.controller.lists.items(kind)


def test_geofence_plugin_uploads_reads_back_and_clears(vehicle):
    geofence = vehicle.plugin(Geofence)
    circle = Circle(Point(*place(20.0, 0.0)), 5.0, FenceType.EXCLUSION)
    geofence.upload_geofence(GeofenceData([square()], [circle]))
    commands = [item.command for item in stored(vehicle, ListKind.FENCE)]
    assert commands == [5001] * 4 + [5004]
    assert vehicle.flight.controller.state.fence.is_active
    geofence.clear_geofence()
    assert stored(vehicle, ListKind.FENCE) == ()
    assert not vehicle.flight.controller.state.fence.is_active


def test_geofence_that_crosses_itself_is_refused_and_the_old_one_kept(vehicle):
    geofence = vehicle.plugin(Geofence)
    geofence.upload_geofence(GeofenceData([square()], []))
    with pytest.raises(GeofenceError):
        geofence.upload_geofence(GeofenceData([square((SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]))], []))
    assert len(stored(vehicle, ListKind.FENCE)) == 4
    geofence.clear_geofence()


def test_raw_fence_and_rally_points_are_uploaded_and_read_back(vehicle):
    raw = vehicle.plugin(MissionRaw)
    fence = raw_items(1, [(0, 5002, 3.0, point, 0.0) for point in SQUARE[:3]])
    rally = raw_items(2, [(3, 5100, 0.0, (30.0, 10.0), 15.0), (3, 5100, 0.0, (-30.0, 10.0), 12.0)])
    raw.upload_geofence(fence)
    raw.upload_rally_points(rally)

    def essence(items):
        return [(item.seq, item.command, item.param1, item.x, item.y, item.z) for item in items]

    assert essence(raw.download_geofence()) == essence(fence)
    assert essence(raw.download_rallypoints()) == essence(rally)
    assert stored(vehicle, ListKind.MISSION) == ()
    with pytest.raises(MissionRawError) as refused:
        raw.upload_rally_points(raw_items(2, [(3, 16, 0.0, (30.0, 10.0), 15.0)]))
    assert refused.value.result == MissionRawResult.UNSUPPORTED
    assert len(stored(vehicle, ListKind.RALLY)) == 2


@pytest.mark.slow
def test_geofence_plugin_over_udp(tmp_path):
    with IdleVehicle(tmp_path, "--trees", 0, speed=5.0) as vehicle:
        mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        assert mavsdk.add_any_connection(f"udpin://127.0.0.1:{vehicle.api_port}") == ConnectionResult.SUCCESS
        system = mavsdk.first_autopilot(START_UP_S)
        assert system is not None, "no heartbeat"
        geofence, raw = Geofence(system), MissionRaw(system)
        geofence.upload_geofence(GeofenceData([square()], []))
        assert [item.command for item in raw.download_geofence()] == [5001] * 4
        geofence.clear_geofence()
        assert raw.download_geofence() == []
        mavsdk.destroy()
