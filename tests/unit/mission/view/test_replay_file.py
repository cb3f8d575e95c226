"""Recordings: what the log of a flight keeps for its replay, and what is refused."""

import numpy as np
import pytest

from mission.flight import Flight, FlightConfig
from mission.view.flight_snapshot import moment_of
from mission.view.replay_file import RecordingError, keep_for_replay, load_recording
from sim.world.world import WorldConfig
from tests.unit.mission.view.rows import hovering, write_log

SMALL = WorldConfig(size_m=64.0, trees_per_ha=0.0)
ACTION = (0.5, -0.25, 1.0, 0.0)


def flown(folder, seconds=1.0, **replay):
    """The moments of a flight as the live page shows them, and its log in the folder."""
    flight, moments = Flight(FlightConfig(world=SMALL), folder=folder), []
    keep_for_replay(flight, **replay)
    flight.run(lambda f: f.time_us >= seconds * 1e6, on_frame=lambda f: moments.append(moment_of(f).row))
    flight.close()
    return np.array(moments)


def test_a_replay_shows_every_frame_as_the_live_page_did(tmp_path):
    way = [(0.0, 0.0, 0.0), (5.0, 0.0, -3.0)]
    shown = flown(tmp_path, path_ned=way, action=lambda: ACTION)
    recording = load_recording(tmp_path)
    assert recording.config == FlightConfig(world=SMALL)
    assert recording.path_ned.tolist() == [list(point) for point in way]
    assert len(recording) == 50
    for name in shown.dtype.names:
        expected = np.broadcast_to(np.float32(ACTION), (50, 4)) if name == "action" else shown[name]
        assert recording.rows[name].tobytes() == np.ascontiguousarray(expected).tobytes(), name
    assert not recording.moment(0).has_owner


def test_what_is_in_the_log_is_what_is_shown(tmp_path):
    recording = hovering()
    write_log(recording, tmp_path / "flight.ulg")
    loaded = load_recording(tmp_path)
    assert loaded.rows.tobytes() == recording.rows.tobytes()
    assert loaded.moment(3).distance_m == pytest.approx(np.hypot(2.0, 0.4), abs=1e-5)


def test_a_long_log_is_shown_from_the_first_of_its_parts_to_the_last(tmp_path):
    for name, begin, end in (("flight.ulg", 0, 40), ("flight-2.ulg", 40, 70), ("flight-10.ulg", 70, 100)):
        part = hovering()
        write_log(type(part)(part.config, part.rows[begin:end], part.path_ned), tmp_path / name)
    assert load_recording(tmp_path).rows.tobytes() == hovering().rows.tobytes()


def test_a_copy_of_a_log_beside_it_is_no_part_of_it(tmp_path):
    write_log(hovering(), tmp_path / "flight.ulg")
    write_log(hovering(), tmp_path / "flight-copy.ulg")
    assert load_recording(tmp_path).rows.tobytes() == hovering().rows.tobytes()


@pytest.mark.parametrize("at", [0, 50, 98, 99])
@pytest.mark.parametrize("time_us", [0, 1 << 60])
def test_a_damaged_time_costs_the_moment_that_had_it(tmp_path, at, time_us):
    recording = hovering()
    recording.rows["pos_ned"][:, 0] = np.arange(100.0)
    path = tmp_path / "flight.ulg"
    write_log(recording, path)
    content, time = path.read_bytes(), int(10_000_000 + 20_000 * at).to_bytes(8, "little")
    path.write_bytes(content.replace(time, time_us.to_bytes(8, "little"), 1))  # of the first topic
    assert load_recording(tmp_path).rows.tobytes() == np.delete(recording.rows, at).tobytes()


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"holds no run that can be shown: flight\.ulg is missing"):
        load_recording(tmp_path)


@pytest.mark.parametrize("content", [b"", b"not a log", b"ULog\x01\x12\x35\x01broken"])
def test_a_damaged_log_is_refused(tmp_path, content):
    (tmp_path / "flight.ulg").write_bytes(content)
    with pytest.raises(RecordingError, match=r"flight\.ulg: "):
        load_recording(tmp_path)


def test_a_log_cut_short_is_shown_as_far_as_it_goes(tmp_path):
    flown(tmp_path, 3.0)
    path = tmp_path / "flight.ulg"
    path.write_bytes(path.read_bytes()[:-20_000])
    assert 50 <= len(load_recording(tmp_path)) < 150


def test_a_run_of_a_version_that_kept_a_file_for_replays_is_told_what_to_do(tmp_path):
    flight = Flight(FlightConfig(world=SMALL), folder=tmp_path)
    flight.frame()
    flight.close()
    with pytest.raises(RecordingError, match=r"show it with the version that wrote it$"):
        load_recording(tmp_path)
