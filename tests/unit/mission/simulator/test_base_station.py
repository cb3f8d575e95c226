import numpy as np

from mission.flight import Flight, FlightConfig


def estimate_error_m(flight):
    """Of the horizontal position [m]."""
    estimate = flight.rig.rows["autopilot.ekf.rows"][0]["estimate"]["pos_ned"]
    return float(np.linalg.norm((estimate - flight.rig.rows["truth"][0]["pos_ned"])[:2]))


def advance(flight, seconds):
    end_us = flight.time_us + round(seconds * 1e6)
    flight.run(lambda _: flight.time_us >= end_us)


def test_corrections_of_the_base_station_make_the_position_exact_at_once_and_without_them_it_is_not():
    errors = {}
    for has_base in (True, False):
        flight = Flight(FlightConfig(seed=6, has_base=has_base))
        advance(flight, 8.0)
        errors[has_base] = estimate_error_m(flight)
        flight.close()
    assert errors[True] < 0.06
    assert errors[False] > 0.3


def test_without_corrections_any_more_the_error_is_that_of_a_plain_receiver_again():
    flight = Flight(FlightConfig(seed=6, has_base=True))
    advance(flight, 8.0)
    assert int(flight.controller.state.samples.gnss.fix_type) == 6
    state = flight.rig.rows["sensors"][0]["gnss"]
    corrected = state["correlated_ned"].copy()
    flight._components[0]._due_us = 1 << 62
    advance(flight, 11.0)
    assert int(flight.controller.state.samples.gnss.fix_type) == 3
    assert np.abs(state["correlated_ned"]).max() > 20.0 * np.abs(corrected).max()
