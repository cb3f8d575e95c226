"""A short run of `make fuzz`: nothing that comes in stops a vehicle that hovers, or moves it."""

import pytest

from autopilot.interface.vehicle_state import Mode
from tests.fuzz.hover import Hover
from tests.fuzz.modes import FRAME_MAX_S, ModeFlight

WORST_FRAME_S = 1.0  # of processor time of all threads; 6 ms as a rule, but the machine does other things


@pytest.mark.parametrize(("kind", "count", "per_frame"), [("broken", 20_000, 32), ("valid", 6_000, 3)])
def test_traffic_neither_stops_nor_moves_a_hovering_vehicle(kind, count, per_frame, tmp_path):
    hover = Hover(1, tmp_path)
    hover.send(count, kind, per_frame)
    assert hover.work_off() < 1_000
    assert hover.worst_frame_s < WORST_FRAME_S
    hover.flight.close()


@pytest.mark.parametrize("dialect", ["px4", "ardupilot"])
def test_extreme_numbers_end_no_flight_in_any_mode(dialect):
    flight = ModeFlight(3, dialect)
    for mode in Mode:
        flight.send(mode, 480)
    flight.close()
    assert flight.worst_frame_s < FRAME_MAX_S
    assert sum(flight.frames_in.values()) > 0.5 * sum(flight.frames.values())
    assert min(flight.frames_in.values()) > 0, flight.frames_in
