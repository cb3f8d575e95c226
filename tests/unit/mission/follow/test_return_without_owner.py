"""An owner who is lost for good: the vehicle holds, and goes home after a while without them, unless somebody minds."""

import pytest

from autopilot.interface.vehicle_state import Mode
from policies.companion.engagement import Phase
from tests.unit.mission.follow.follow_flight import advance, following, hide, lose

LOST_S, RETURN_S = 3.0, 4.0
SETTINGS = {"search_s": 2.5, "lost_s": LOST_S, "return_s": RETURN_S}


def lost(**changed):
    """A flight in Hold, since its owner was lost."""
    flight, companion = following(**{"settings": SETTINGS} | changed)
    advance(flight, 3.0)
    hide(flight)
    lose(companion, "FOLLOW_TARGET")
    advance(flight, LOST_S + 3.0, lambda: companion.phase is Phase.RELEASED)
    assert flight.controller.state.mode in (Mode.HOLD, Mode.BRAKE)
    return flight, companion


@pytest.mark.parametrize("dialect", ["px4", "ardupilot"])
def test_it_goes_home_and_lands_there(dialect):
    flight, _ = lost(dialect=dialect)
    held_us = flight.time_us
    advance(flight, RETURN_S + 2.0, lambda: flight.controller.state.mode is Mode.RETURN)
    assert flight.controller.state.mode is Mode.RETURN
    assert -0.2e6 < flight.time_us - held_us - RETURN_S * 1e6 < 1.2e6  # it waits for the next heartbeat
    if dialect == "px4":  # the other's script hears no companion
        assert "Companion: owner lost, returning" in flight.drone.texts
    advance(flight, 120.0, lambda: not flight.controller.state.is_armed)
    assert not flight.controller.state.is_armed
    assert not flight.is_crashed
    north, east, _ = flight.rig.rows["truth"][0]["pos_ned"]
    assert abs(north) < 2.0
    assert abs(east) < 2.0


def test_a_pilot_who_chooses_another_mode_meanwhile_keeps_it():
    flight, _ = lost()
    flight.drone.send("MANUAL_CONTROL", target=1, x=0, y=0, z=500, r=0, buttons=0)
    flight.frame()
    command = {"target_system": 1, "target_component": 1, "command": 176, "param1": 1, "param2": 3, "param3": 0}
    flight.drone.send("COMMAND_LONG", **command)
    modes = set()
    end_us = flight.time_us + round((RETURN_S + 3.0) * 1e6)

    def fly_on(_):
        flight.drone.send("MANUAL_CONTROL", target=1, x=0, y=0, z=500, r=0, buttons=0)
        modes.add(flight.controller.state.mode)
        return flight.time_us >= end_us

    flight.run(fly_on)
    assert Mode.POSITION in modes
    assert Mode.RETURN not in modes


def test_a_pilot_who_takes_it_over_on_the_way_home_keeps_it():
    flight, _ = lost()
    advance(flight, RETURN_S + 2.0, lambda: flight.controller.state.mode is Mode.RETURN)
    flight.fly(lambda drone: drone.hold(), seconds=5.0)
    advance(flight, 2.0 * RETURN_S)
    assert flight.controller.state.mode is Mode.HOLD


def test_an_owner_who_is_back_is_not_left():
    flight, companion = lost(numbers={"phone_error": 0.0, "owner_stop_share": 1.0})
    flight.owner.cast.rows.params.numpy()["owner_hides_per_min"] = 0.0
    advance(flight, 2.0, lambda: not companion.skill.is_alone(companion.vehicle.own))
    assert not companion.skill.is_alone(companion.vehicle.own)
    advance(flight, 2.0 * RETURN_S)
    assert flight.controller.state.mode is Mode.HOLD


def test_with_nothing_set_for_it_it_holds():
    flight, _ = lost(settings=SETTINGS | {"return_s": 0.0})
    advance(flight, 3.0 * RETURN_S)
    assert flight.controller.state.mode is Mode.HOLD
