"""A flight in lockstep with its companion on board is the same flight byte for byte."""

from tests.unit.mission.follow.follow_flight import advance, following


def test_two_flights_with_a_companion_write_the_same_bytes(tmp_path):
    for name in ("first", "second"):
        folder = tmp_path / name
        folder.mkdir()
        flight, _ = following(folder, pace="run")
        advance(flight, 15.0)
        flight.close()
    for log in ("flight.tlog", "flight.ulg"):
        first, second = ((tmp_path / name / log).read_bytes() for name in ("first", "second"))
        assert len(first) > 100_000
        assert first == second, log
