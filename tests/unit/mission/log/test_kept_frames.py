"""Long flights: what is kept of each frame is little, and next to nothing while the vehicle is left idle."""

import tracemalloc

import numpy as np
import pytest

from common.kernels import FRAME_US
from mission.flight import Flight, FlightConfig
from mission.log.kept_frames import QUIET_AFTER_US, FrameChoice, KeptRows
from mission.view.replay_file import keep_for_replay, load_recording
from sim.world.world import WorldConfig

ROW = np.dtype([("time_us", "u8"), ("pos_ned", "f4", 3)])
SECOND_US = 1_000_000


def chosen(seconds, is_armed):
    """Times [s] of the frames that are kept; `is_armed` is asked with the time [s]."""
    choice = FrameChoice()
    times_us = range(FRAME_US, int(seconds * SECOND_US) + 1, FRAME_US)
    return np.array([t for t in times_us if choice.keeps(t, is_armed=is_armed(t * 1e-6))]) * 1e-6


def test_every_frame_is_kept_while_armed_and_two_minutes_longer():
    kept = chosen(1000.0, lambda t: 300.0 < t <= 400.0)
    quiet_s = QUIET_AFTER_US * 1e-6
    assert np.count_nonzero(kept <= quiet_s) == quiet_s * 50
    assert np.count_nonzero((kept > quiet_s) & (kept <= 300.0)) == 300.0 - quiet_s
    assert np.count_nonzero((kept > 300.0) & (kept <= 400.0 + quiet_s)) == (100.0 + quiet_s) * 50
    assert np.count_nonzero(kept > 400.0 + quiet_s) == 600.0 - quiet_s


@pytest.mark.parametrize("batch", [1, 7, 5000])
def test_rows_come_back_as_they_were_added_and_the_last_one_always(batch):
    rows = np.zeros(10_001, ROW)
    rows["time_us"] = np.arange(len(rows))
    rows["pos_ned"][:, 1] = rows["time_us"] * 0.5
    is_kept = rows["time_us"] % 3 == 0
    kept = KeptRows(ROW)
    for start in range(0, len(rows), batch):
        kept.add(rows[start : start + batch], is_kept[start : start + batch])
    expected = np.concatenate([rows[is_kept], rows[-1:]])  # 10,000 is no multiple of 3
    assert kept.all().tobytes() == expected.tobytes()
    assert kept.all().tobytes() == expected.tobytes()  # asking changes nothing
    assert len(KeptRows(ROW).all()) == 0


def idle_flight(folder):
    flight = Flight(FlightConfig(world=WorldConfig(size_m=64.0, trees_per_ha=0.0)), folder=folder)
    keep_for_replay(flight)
    return flight


def idle_until(flight, seconds):
    flight.run(lambda f: f.time_us >= seconds * SECOND_US)


def test_a_flight_holds_less_than_half_a_kilobyte_per_frame(tmp_path):
    flight = idle_flight(tmp_path)
    tracemalloc.start()
    try:
        idle_until(flight, 6.0)  # the first chunk of rows is there
        before = tracemalloc.get_traced_memory()[0]
        idle_until(flight, 14.0)
        assert (tracemalloc.get_traced_memory()[0] - before) / (8.0 * 50.0) < 500.0
    finally:
        tracemalloc.stop()
    flight.close()


def test_history_and_recording_of_an_idle_vehicle_thin_out_alike(tmp_path):
    flight = idle_flight(tmp_path)
    idle_until(flight, 130.5)
    history = flight.close()
    rows = load_recording(tmp_path).rows
    assert len(rows) == 120 * 50 + 10
    assert np.diff(rows["time_s"])[-10:] == pytest.approx([1.0] * 10)
    assert history.time_us[:-1].tolist() == np.round(rows["time_s"] * 1e6).astype(int).tolist()
    assert history.time_us[-1] == 130_500_000  # how the flight ended
