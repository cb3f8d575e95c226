"""Flights for Foxglove: the file that is written, what a kept log becomes, and who is connected while it is flown."""

import json
import struct
import sys
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from pyulog import ULog
from scipy.spatial.transform import Rotation
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from common.clock import wall_time_s
from mission.cli import main
from mission.flight import Flight, FlightConfig
from mission.foxglove.outputs import FoxgloveOutputs
from tests.unit.mission.foxglove.mcap_messages import read, us_of

SECONDS = 14
FLY = ("fly", "--speed", "max", "--seconds", SECONDS, "--lidar", "--trees", "5")
MESSAGE_DATA = 1  # of Foxglove's protocol


def run(*arguments):
    """The console command, to its end in this process."""
    before, sys.argv = sys.argv, ["honeyguide", *map(str, arguments)]
    try:
        with pytest.raises(SystemExit) as end:
            main()
    finally:
        sys.argv = before
    return end.value.code


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A flight's folder, and what its file holds."""
    folder = tmp_path_factory.mktemp("flown") / "run"
    run(*FLY, "--mcap", "--run-folder", folder)
    return SimpleNamespace(folder=folder, messages=read(folder / "flight.mcap"))


@pytest.fixture(scope="module")
def converted(flown):
    path = flown.folder.parent / "converted.mcap"
    run("mcap", flown.folder / "flight.ulg", path)
    return read(path)


def test_every_kind_of_channel_is_there(flown):
    kinds = {topic: messages[0].schema for topic, messages in flown.messages.items()}
    assert (
        kinds.items()
        >= {
            "/tf": "foxglove.FrameTransforms",
            "/pose/true": "foxglove.PoseInFrame",
            "/pose/estimate": "foxglove.PoseInFrame",
            "/pose/setpoint": "foxglove.PoseInFrame",
            "/trail/true": "foxglove.PosesInFrame",
            "/location/gnss": "foxglove.LocationFix",
            "/scene/world": "foxglove.SceneUpdate",
            "/scene/plan": "foxglove.SceneUpdate",
            "/camera/image": "foxglove.CompressedImage",
            "/camera/calibration": "foxglove.CameraCalibration",
            "/camera/points": "foxglove.PointCloud",
            "/ring": "foxglove.LaserScan",
            "/log": "foxglove.Log",
            "/attitude": "honeyguide.Attitude",
            "/estimator/test_ratios": "honeyguide.TestRatios",
            "/outputs": "honeyguide.Outputs",
        }.items()
    )
    counts = {topic: len(flown.messages[topic]) for topic in ("/tf", "/camera/image", "/ring", "/scene/world")}
    assert counts == {"/tf": 25 * SECONDS, "/camera/image": 2 * SECONDS, "/ring": 10 * SECONDS, "/scene/world": 1}


def test_a_pose_is_that_of_the_ulog(flown):
    log = ULog(str(flown.folder / "flight.ulg"))
    place = log.get_dataset("vehicle_local_position_groundtruth").data
    attitude = log.get_dataset("vehicle_attitude_groundtruth").data
    rows = {int(time): row for row, time in enumerate(place["timestamp"])}
    compared = 0
    for time_us, _, message in flown.messages["/pose/true"]:
        row = rows.get(time_us)
        if row is None:
            continue
        position, turn = message.pose.position, message.pose.orientation
        assert (position.y, position.x, -position.z) == pytest.approx([place[axis][row] for axis in "xyz"], abs=1e-5)
        ned_from_frd = Rotation.from_quat([attitude[f"q[{i}]"][row] for i in (1, 2, 3, 0)])
        ahead, up = (Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).apply(axis) for axis in np.eye(3)[[0, 2]])
        assert ahead[[1, 0, 2]] * (1, 1, -1) == pytest.approx(ned_from_frd.apply((1, 0, 0)), abs=1e-5)
        assert up[[1, 0, 2]] * (1, 1, -1) == pytest.approx(ned_from_frd.apply((0, 0, -1)), abs=1e-5)
        compared += 1
    assert compared > 20 * (SECONDS - 6)


def test_what_is_told_of_the_camera_fits_together(flown):
    (image, *_), (model, *_), (points, *_) = (
        [message.value for message in flown.messages[f"/camera/{part}"]] for part in ("image", "calibration", "points")
    )
    pixels = cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_COLOR)
    assert pixels.shape == (model.height, model.width, 3)
    assert us_of(image.timestamp) == us_of(model.timestamp) == us_of(points.timestamp)
    assert len(points.data) % points.point_stride == 0
    children = {each.child_frame_id: each.parent_frame_id for each in flown.messages["/tf"][-1].value.transforms}
    assert children[points.frame_id] == "vehicle"


def test_the_scene_has_ground_trees_and_the_vehicle(flown):
    (world,) = (message.value for message in flown.messages["/scene/world"])
    entities = {entity.id: entity for entity in world.entities}
    assert {"ground", "trees"} <= set(entities)
    assert len(entities["trees"].cylinders) == len(entities["trees"].spheres) > 100
    ground = entities["ground"].triangles[0]
    assert max(ground.indices) < len(ground.points) == len(ground.colors)
    heights = [point.z for point in ground.points]
    assert 2.0 < max(heights) < 13.0  # hills of 12 m
    (shape,) = (message.value for message in flown.messages["/scene/vehicle"])
    assert (shape.entities[0].frame_id, shape.entities[0].frame_locked) == ("vehicle", True)


def test_two_flights_write_the_same_bytes(flown):
    again = flown.folder.parent / "again"
    run(*FLY, "--mcap", "--run-folder", again)
    assert (again / "flight.mcap").read_bytes() == (flown.folder / "flight.mcap").read_bytes()


def test_a_flight_is_the_same_with_it_and_without(flown):
    plain = flown.folder.parent / "plain"
    run(*FLY, "--run-folder", plain)
    assert not (plain / "flight.mcap").exists()
    assert (plain / "flight.ulg").read_bytes() == (flown.folder / "flight.ulg").read_bytes()


def test_a_kept_log_becomes_the_same_poses(flown, converted):
    for topic in ("/pose/true", "/pose/estimate", "/velocity", "/rates"):
        live = {message.time_us: message.value for message in flown.messages[topic]}
        common = [message for message in converted[topic] if message.time_us in live]
        assert len(common) > 20 * (SECONDS - 6)
        for message in common:
            kept = live[message.time_us]
            if isinstance(kept, dict):
                assert message.value["true"] == pytest.approx(kept["true"], abs=1e-5)
            else:
                assert message.value.pose.position.x == pytest.approx(kept.pose.position.x, abs=1e-5)


def test_a_kept_log_brings_its_scene_and_texts(flown, converted):
    kept, live = (found["/scene/world"][0].value.SerializeToString() for found in (converted, flown.messages))
    assert kept == live
    texts = [[message.value.message for message in found["/log"]] for found in (converted, flown.messages)]
    assert texts[0] == texts[1] != []


def test_ratios_of_a_kept_log_are_those_of_the_estimator(flown, converted):
    """A log has innovations and variances; the gate is a parameter of it."""
    live = {message.time_us: message.value for message in flown.messages["/estimator/test_ratios"]}
    compared = 0
    for message in converted["/estimator/test_ratios"]:
        kept = live.get(message.time_us, {})
        if "baro" in kept and "baro_vpos" in message.value:
            assert message.value["baro_vpos"] == pytest.approx(kept["baro"], rel=1e-3, abs=1e-5)
            compared += 1
    assert compared > 50


@pytest.mark.parametrize(
    "arguments", [("fly", "--mcap", "--idle"), ("fly", "--foxglove", "--idle"), ("mcap", __file__)]
)
def test_without_the_extra_one_sentence_says_so(arguments, capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert run(*arguments) == 2
    (line,) = [line for line in capfd.readouterr().err.splitlines() if "extra" in line]
    assert line.endswith("comes with the extra 'foxglove' (docs/start/installing.md)")


def test_what_is_no_log_is_refused_and_nothing_is_written(tmp_path, capfd):
    (tmp_path / "flight.mcap").write_text("kept")
    (tmp_path / "flight.ulg").write_text("no log")
    assert run("mcap", tmp_path / "flight.ulg") == 2
    assert "damaged" in capfd.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flight.mcap", "flight.ulg"]
    assert (tmp_path / "flight.mcap").read_text() == "kept"


@pytest.fixture(scope="module")
def connected(tmp_path_factory):
    """A flight that somebody can connect to."""
    flight = Flight(FlightConfig())
    with closing(FoxgloveOutputs(has_file=False, port=0)) as outputs:
        outputs.begin(flight, Path(tmp_path_factory.mktemp("live")), (), has_camera_thread=False)
        yield flight, outputs
    flight.close()


def advance(flight, outputs, frames=2):
    for _ in range(frames):
        flight.frame()
        outputs.frame()


def heard(socket, flight, outputs, wanted, *, within_s=20.0):
    """Messages by topic, until all that is wanted has come."""
    subscriptions, found = {}, {}
    end_s = wall_time_s() + within_s
    while not wanted <= set(found) and wall_time_s() < end_s:
        advance(flight, outputs)
        for message in waiting(socket):
            if isinstance(message, str):
                subscribe(socket, json.loads(message), subscriptions)
            elif message[0] == MESSAGE_DATA:
                number, time_ns = struct.unpack("<IQ", message[1:13])
                found.setdefault(subscriptions[number], []).append((time_ns, message[13:]))
    return found


def waiting(socket):
    """What has come by now."""
    while True:
        try:
            yield socket.recv(timeout=0.02)
        except TimeoutError:
            return


def subscribe(socket, told, subscriptions):
    """Asks for every channel that is offered."""
    for channel in told.get("channels", ()) if told["op"] == "advertise" else ():
        number = len(subscriptions) + 1
        subscriptions[number] = channel["topic"]
        asked = {"op": "subscribe", "subscriptions": [{"id": number, "channelId": channel["id"]}]}
        socket.send(json.dumps(asked))


def test_who_connects_gets_the_scene_and_what_goes_on(connected):
    flight, outputs = connected
    advance(flight, outputs, 50)
    with connect(outputs.url, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
        found = heard(socket, flight, outputs, {"/scene/world", "/tf", "/position", "/camera/image"})
    assert set(found) >= {"/scene/world", "/tf", "/position", "/camera/image"}
    assert len(found["/scene/world"]) == 1
    times = [time_ns for time_ns, _ in found["/tf"]]
    assert times == sorted(times)
    assert 1_000_000_000 <= times[0] <= flight.time_us * 1000  # simulated


def test_a_second_viewer_gets_the_scene_too(connected):
    flight, outputs = connected
    for _ in range(2):
        with connect(outputs.url, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
            assert "/scene/world" in heard(socket, flight, outputs, {"/scene/world"})


def test_who_does_not_know_the_token_is_refused(connected):
    _, outputs = connected
    with pytest.raises(InvalidStatus, match="403"):
        connect(outputs.url.rpartition("/")[0] + "/", subprotocols=["foxglove.sdk.v1"])


def test_nothing_that_a_viewer_sends_is_taken(connected):
    flight, outputs = connected
    before = {name: flight.params[name] for name in flight.params}
    with connect(outputs.url, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
        told = json.loads(socket.recv(timeout=5.0))
        assert (told["op"], told["capabilities"]) == ("serverInfo", [])
        asked = '{"op":"setParameters","parameters":[{"name":"EKF2_HGT_REF","value":3}]}'
        for message in (asked, "{", "\x00", b"\xff" * 64):
            try:
                socket.send(message)
            except ConnectionClosed:
                break
        advance(flight, outputs, 10)
    assert {name: flight.params[name] for name in flight.params} == before


def test_a_port_that_is_taken_is_told(capfd, tmp_path):
    with closing(FoxgloveOutputs(has_file=False, port=0)) as other:
        port = int(other.url.rpartition(":")[2].partition("/")[0])
        assert run("fly", "--idle", "--foxglove", "--foxglove-port", port, "--run-folder", tmp_path / "run") == 2
    assert f"--foxglove-port {port}: " in capfd.readouterr().err
