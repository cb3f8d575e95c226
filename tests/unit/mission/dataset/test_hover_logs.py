"""Hover of logs of others: topics of several releases of PX4, and telemetry logs; what lacks a topic is refused."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink
from typer.testing import CliRunner

from common.logs.tlog import TlogWriter
from common.logs.ulog import UlogWriter
from mission.cli import app
from mission.dataset.companion_log import ImageFile
from mission.dataset.hover_logs import read_hover_log
from policies.datasets.episodes import DatasetError
from policies.datasets.reader import DatasetReader

SECONDS = 5
THRUST, ROLL_RATE = 0.6, 0.3
OLD = {  # PX4 1.8
    "vehicle_attitude": ({"rollspeed": 0.1, "pitchspeed": 0.0, "yawspeed": 0.0, "q": (1.0, 0.0, 0.0, 0.0)}, 50),
    "vehicle_rates_setpoint": ({"roll": ROLL_RATE, "pitch": 0.0, "yaw": 0.0, "thrust": THRUST}, 50),
}
NEW = {  # PX4 1.15
    "vehicle_attitude": ({"q": (1.0, 0.0, 0.0, 0.0)}, 50),
    "vehicle_angular_velocity": ({"xyz": (0.1, 0.0, 0.0)}, 50),
    "vehicle_rates_setpoint": (
        {"roll": ROLL_RATE, "pitch": 0.0, "yaw": 0.0, "thrust_body": (0.0, 0.0, -THRUST)},
        100,
    ),
}
BOTH = {
    "vehicle_local_position": ({"x": 1.0, "y": 0.0, "z": -5.0, "vx": 0.0, "vy": 0.0, "vz": 0.0}, 10),
    "vehicle_local_position_setpoint": ({"x": 2.0, "y": 0.0, "z": -5.0}, 10),
    "vehicle_land_detected": ({"landed": False}, 1),
}


def ulog(path, topics):
    """A log in which every topic says the same all the time."""
    log = UlogWriter(path, 0, {"sys_name": "PX4"}, {})
    added = []
    for name, (fields, rate_hz) in topics.items():
        kinds = {key: _kind(value) for key, value in fields.items()}
        added.append((log.add_topic(name, kinds), fields, rate_hz))
    for topic, fields, rate_hz in added:
        times = np.arange(0, SECONDS * 1_000_000 + 1, 1_000_000 // rate_hz)
        topic.write({"timestamp": times, **{key: np.array([value] * len(times)) for key, value in fields.items()}})
    log.close()
    return path


def _kind(value):
    return "bool" if isinstance(value, bool) else f"float[{len(value)}]" if isinstance(value, tuple) else "float"


@pytest.mark.parametrize("release", [OLD, NEW], ids=["1.8", "1.15"])
def test_topics_of_any_release_say_the_same(tmp_path, release):
    log = read_hover_log(ulog(tmp_path / "px4.ulg", release | BOTH))
    assert log.is_airborne.all()
    assert log.is_fresh.all()
    assert np.allclose(log.thrust, THRUST)
    assert np.allclose(log.omega_frd, (0.1, 0.0, 0.0))
    assert np.allclose(log.omega_frd_sp, (ROLL_RATE, 0.0, 0.0))
    assert np.allclose(log.pos_ned_sp - log.pos_ned, (1.0, 0.0, 0.0))
    assert np.allclose(log.q_ned_from_frd, (0.0, 0.0, 0.0, 1.0))


@pytest.mark.parametrize("topic", ["vehicle_local_position", "vehicle_rates_setpoint", "vehicle_angular_velocity"])
def test_a_log_without_a_topic_is_refused_by_its_name(tmp_path, topic):
    topics = {name: each for name, each in (NEW | BOTH).items() if name != topic}
    with pytest.raises(DatasetError, match=f"px4.ulg: has no topic {topic}, which Hover needs"):
        read_hover_log(ulog(tmp_path / "px4.ulg", topics))


def test_the_command_builds_it_the_same_each_time_and_leaves_nothing_of_a_refused_one(tmp_path):
    log = ulog(tmp_path / "px4.ulg", NEW | BOTH)
    empty = ulog(tmp_path / "empty.ulg", BOTH)
    run = CliRunner()
    for name in ("one", "other"):
        done = run.invoke(app, ["dataset", "build", str(log), "--task", "Hover", "-o", str(tmp_path / name)])
        assert done.exit_code == 0, done.output
    for file in ("main_data.hdf5", "metadata.json"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "other" / file).read_bytes()
    with DatasetReader(tmp_path / "one") as reader:
        (episode,) = list(reader)
    assert len(episode) > 40 * SECONDS
    assert np.allclose(episode.actions[:, 0], ROLL_RATE / 3.0)
    assert np.allclose(episode.actions[:, 3], 2.0 * THRUST - 1.0)
    before = set(tmp_path.iterdir())
    refused = run.invoke(
        app, ["dataset", "build", str(log), str(empty), "--task", "Hover", "-o", str(tmp_path / "third")]
    )
    assert refused.exit_code == 2
    assert "empty.ulg: has no topic vehicle_attitude" in refused.stderr
    assert set(tmp_path.iterdir()) == before


def test_a_telemetry_log_tells_of_hover_too(tmp_path):
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    log = TlogWriter(tmp_path / "station.tlog")
    for time_ms in range(0, SECONDS * 1000, 50):
        messages = (
            mavlink.MAVLink_local_position_ned_message(time_ms, 1.0, 0.0, -5.0, 0.0, 0.0, 0.0),
            mavlink.MAVLink_attitude_quaternion_message(time_ms, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0),
            mavlink.MAVLink_attitude_target_message(time_ms, 0, [1.0, 0.0, 0.0, 0.0], ROLL_RATE, 0.0, 0.0, THRUST),
            mavlink.MAVLink_position_target_local_ned_message(time_ms, 1, 0, 2, 0, -5, 0, 0, 0, 0, 0, 0, 0, 0),
        )
        for message in messages:
            log.frame(time_ms * 1000, bytes(message.pack(sender)))
    log.close()
    found = read_hover_log(tmp_path / "station.tlog")
    assert np.allclose(found.thrust, THRUST)
    assert np.allclose(found.pos_ned_sp - found.pos_ned, (1.0, 0.0, 0.0))


def test_a_file_that_is_no_log_is_refused(tmp_path):
    for name in ("text.ulg", "text.tlog"):
        (tmp_path / name).write_text("no log at all, of any kind")
        with pytest.raises(DatasetError, match=name):
            read_hover_log(tmp_path / name)


def test_images_that_cannot_be_written_are_reported_once_and_end_nothing(tmp_path):
    reported = []
    images = ImageFile(tmp_path / "missing" / "images.zip", reported.append)
    image = np.zeros((4, 4, 4), np.uint8)
    assert [images.add(image), images.add(image)] == [-1, -1]
    images.close()
    assert reported == ["images.zip ended: No such file or directory"]
