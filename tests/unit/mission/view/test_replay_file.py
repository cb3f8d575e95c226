"""Recordings: what is kept of a flight, and what is refused."""

import numpy as np
import pytest

from mission.flight import Flight, FlightConfig
from mission.view.replay_file import FILE, Recorder, RecordingError, load_recording
from sim.world.world import WorldConfig
from tests.unit.mission.view.rows import hovering

SMALL = WorldConfig(size_m=64.0, trees_per_ha=0.0)


def test_every_frame_of_a_flight_is_kept():
    flight = Flight(FlightConfig(world=SMALL))
    recorder = Recorder(flight, [(0.0, 0.0, 0.0), (5.0, 0.0, -3.0)])
    flight.run(lambda f: f.time_us >= 1_000_000, on_frame=lambda _: recorder.frame())
    recording = recorder.recording()
    body = flight.rig.rows["truth"][0]
    assert len(recording) == 50
    assert np.diff(recording.rows["time_s"]) == pytest.approx(0.02)
    assert np.array_equal(recording.rows["pos_ned"][-1], body["pos_ned"])
    assert recording.path_ned.shape == (2, 3)
    assert not recording.moment(0).has_owner
    flight.close()


def test_what_is_saved_is_loaded(tmp_path):
    recording = hovering()
    recording.save(tmp_path)
    loaded = load_recording(tmp_path)
    assert loaded.config == recording.config
    assert loaded.rows.tobytes() == recording.rows.tobytes()
    assert loaded.moment(3).distance_m == pytest.approx(np.hypot(2.0, 0.4), abs=1e-5)


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="holds no run"):
        load_recording(tmp_path)


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04 broken"])
def test_a_damaged_recording_is_refused(tmp_path, content):
    (tmp_path / FILE).write_bytes(content)
    with pytest.raises(RecordingError, match="cannot be read") as refusal:
        load_recording(tmp_path)
    assert "pickle" not in str(refusal.value)  # how numpy says that it is no archive


def test_a_recording_of_another_version_is_refused(tmp_path):
    recording = hovering()
    np.savez(tmp_path / FILE, rows=np.zeros(3), path_ned=np.zeros((0, 3)), config=recording.config.model_dump_json())
    with pytest.raises(RecordingError, match="another version"):
        load_recording(tmp_path)
