"""A rover that answers 100 times a second, and only while armed, is driven by a script like any other vehicle."""

import pytest

from tests.unit.mission.boards.px4_pilot import Px4, flight_of
from tests.unit.sim.boards.flown_by import running

INSTANCE = 6  # whose ports no other test uses


def test_it_is_armed_goes_to_a_place_and_is_disarmed():
    px4 = Px4(INSTANCE, is_rover=True)
    flight = flight_of(INSTANCE, airframe="rover")

    async def drive(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.goto_ned(8.0, 0.0, 0.0, acceptance_m=1.0, timeout_s=30.0)
        await drone.disarm()

    with running(px4.work):
        running_script = flight.fly(drive, seconds=40.0)
        flight.close()
    assert running_script.is_done
    assert running_script.error is None
    assert px4.exchange.faults == []
    north_m, east_m, _ = flight.rig.rows["truth"]["pos_ned"][0]
    assert (north_m, east_m) == pytest.approx((8.0, 0.0), abs=1.2)
    assert flight.board.unanswered_count < 0.02 * flight.board.exchange_count
