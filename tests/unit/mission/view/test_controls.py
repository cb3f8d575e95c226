"""The live page's buttons, clicked without a browser; tests/system/page/test_live_page.py clicks in one."""

from types import SimpleNamespace

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from mission.flight import Flight, FlightConfig
from mission.park.parking import ask
from mission.plan.plan_file import DEFAULT_PLAN, moved_plan, read_plan
from mission.script import fly_plan
from mission.view.live import LiveView
from mission.view.page import PageServer
from mission.view.pose_goals import PoseGoals
from policies.companion.engagement import Phase
from sim.world.world import WorldConfig
from tests.unit.mission.follow.follow_flight import advance, following
from tests.unit.mission.follow.park_flight import shipped_pilot, standing

PLAIN = WorldConfig(size_m=64.0, trees_per_ha=0.0)


def buttons(server):
    """What clicks each button, by its label."""
    handles = server.gui._gui_input_handle_from_uuid.values()
    return {handle.label: lambda handle=handle: [call(None) for call in handle._impl.update_cb] for handle in handles}


@pytest.fixture
def page():
    server = PageServer(0, "Honeyguide")
    yield server
    server.stop()


def test_after_the_pilot_has_taken_over_a_button_follows_again(page):
    flight, companion = following()
    view = LiveView(flight, page)

    def fly(seconds, is_enough=lambda: False):
        end_us = flight.time_us + round(seconds * 1e6)
        flight.run(lambda _: is_enough() or flight.time_us >= end_us, on_frame=lambda _: view.frame())

    buttons(page)["Hold"]()
    fly(2.0, lambda: companion.phase is Phase.RELEASED)
    assert companion.phase is Phase.RELEASED
    buttons(page)["Follow"]()  # while the companion is still silent
    fly(6.0, lambda: companion.phase is Phase.FLYING)
    assert companion.phase is Phase.FLYING
    fly(1.0)
    assert view._controls.lines[-1] == "Follow: done"


def test_a_companion_that_is_not_ready_is_told_on_the_page(page):
    flight, companion = following()
    view = LiveView(flight, page)
    flight.onboard.way.sinks.clear()  # no pictures from now on
    advance(flight, 3.0)
    buttons(page)["Follow"]()
    end_us = flight.time_us + 10_000_000
    flight.run(lambda _: flight.time_us >= end_us, on_frame=lambda _: view.frame())
    assert companion.phase is Phase.WAITING
    assert view._controls.lines[-1].startswith("Follow: offboard refused")


def test_without_an_owner_there_is_nobody_to_follow(page):
    flight = Flight(FlightConfig(world=PLAIN))
    LiveView(flight, page)
    assert "Follow" not in buttons(page)
    flight.close()


def said_after(flight, view, seconds, is_enough=lambda: False):
    end_us = flight.time_us + round(seconds * 1e6)
    flight.run(lambda _: is_enough() or flight.time_us >= end_us, on_frame=lambda _: view.frame())
    return "; ".join(view._controls.lines)


def test_take_off_at_power_on_says_what_it_waits_for_and_then_takes_off(page):
    flight = Flight(FlightConfig(world=PLAIN))
    view = LiveView(flight, page)
    buttons(page)["Take off"]()
    assert "Take off …; waits: cannot be armed: " in said_after(flight, view, 0.1)
    said_after(flight, view, 30.0, lambda: flight.controller.state.is_flying)
    assert flight.controller.state.is_flying
    flight.close()


def test_take_off_after_a_crash_says_at_once_why_not_and_restart_helps(page):
    flight = Flight(FlightConfig(world=PLAIN))
    view = LiveView(flight, page)
    buttons(page)["Take off"]()
    said_after(flight, view, 40.0, lambda: flight.drone.pos_ned[2] < -4.0)
    buttons(page)["Kill the motor"]()
    said_after(flight, view, 10.0, lambda: flight.is_crashed and not flight.controller.state.is_armed)
    assert flight.is_crashed
    buttons(page)["Take off"]()
    assert "Take off: cannot be armed: " in said_after(flight, view, 0.1)
    buttons(page)["Restart"]()
    buttons(page)["Take off"]()
    said_after(flight, view, 40.0, lambda: flight.drone.pos_ned[2] < -4.0)
    assert flight.controller.state.is_flying
    assert not flight.is_crashed
    said = [str(text) for text in flight.texts.since(0)]
    assert any("back on its pad" in text for text in said)
    flight.close()


def test_a_crashed_vehicle_that_lies_upright_does_not_take_off_either(page, monkeypatch):
    flight = Flight(FlightConfig(world=PLAIN))
    view = LiveView(flight, page)
    said_after(flight, view, 30.0, lambda: not flight.controller.commander.check_arming())
    monkeypatch.setattr(Flight, "is_crashed", True)
    buttons(page)["Take off"]()
    assert "Take off: cannot be armed: it has crashed" in said_after(flight, view, 0.1)
    assert not flight.controller.state.is_armed
    flight.close()


def test_a_restart_in_flight_puts_it_on_its_pad_with_a_full_battery_and_its_mission_flies_again(page):
    flight = Flight(FlightConfig(world=PLAIN))
    view = LiveView(flight, page, path_ned=[(0.0, 0.0, -5.0), (5.0, 0.0, -5.0)])
    plan = read_plan(DEFAULT_PLAN)
    running = flight.drone.start(fly_plan(flight.drone, moved_plan(plan, flight.config.home)))
    said_after(flight, view, 40.0, lambda: flight.controller.state.is_flying and flight.drone.pos_ned[2] < -3.0)
    buttons(page)["Restart"]()
    said_after(flight, view, 3.0)
    assert running.is_done
    assert not flight.controller.state.is_armed
    body = flight.rig.rows["truth"][0]
    assert float(abs(body["pos_ned"][:2]).max()) < 0.1
    assert flight.controller.state.battery_remaining > 0.99
    buttons(page)["Fly the mission"]()
    said_after(flight, view, 60.0, lambda: flight.drone.pos_ned[2] < -4.0)
    assert flight.controller.state.mode is Mode.MISSION
    flight.close()


def test_a_restart_ends_what_a_button_began(page):
    flight = Flight(FlightConfig(world=PLAIN))
    view = LiveView(flight, page)
    buttons(page)["Take off"]()
    assert "waits: cannot be armed" in said_after(flight, view, 0.1)
    buttons(page)["Restart"]()
    said_after(flight, view, 12.0)
    assert flight.controller.state.is_ready_to_arm
    assert not flight.controller.state.is_armed
    flight.close()


def test_what_stays_on_the_ground_is_offered_neither_take_off_nor_landing_and_drives_where_one_clicks(page):
    flight = Flight(FlightConfig(world=PLAIN, airframe="rover"))
    view = LiveView(flight, page, path_ned=[(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)])
    labels = set(buttons(page))
    assert {"Hold", "Return", "Drive the mission", "Restart"} <= labels
    assert not {"Take off", "Land", "Fly the mission", "Height of gotos"} & labels
    ray = SimpleNamespace(ray_origin=(10.0, 4.0, -20.0), ray_direction=(0.0, 0.0, 1.0))
    view._controls._clicked(ray)
    said_after(flight, view, 30.0, lambda: view._controls.lines[-1].endswith("done"))
    assert view._controls.lines[-1].startswith("go to 10 m north, 4 m east")
    assert view._controls.lines[-1].endswith("done")
    assert np.hypot(*(flight.rig.rows["truth"][0]["pos_ned"][:2] - (10.0, 4.0))) < 1.5
    flight.close()


def test_buttons_of_spots_and_clicks_send_the_companion_of_a_rover_there(page):
    flight, companion = standing(pilot=shipped_pilot("drive-reach"), world=PLAIN)
    asked = []

    async def go(drone, pose):
        asked.append(pose)
        await ask(drone, pose)

    goals = PoseGoals((("spot 3", (6.0, 3.0, 0.5)),), go, lambda: companion.skill.goal_pose(companion.vehicle.own))
    view = LiveView(flight, page, goals=goals)
    buttons(page)["spot 3"]()
    assert "spot 3: done" in said_after(flight, view, 1.0)
    assert companion.phase is Phase.FLYING
    view._controls._clicked(SimpleNamespace(ray_origin=(4.0, -2.0, -5.0), ray_direction=(0.0, 0.0, 1.0)))
    said_after(flight, view, 1.0)
    assert asked[0] == (6.0, 3.0, 0.5)
    assert asked[1][:2] == pytest.approx((4.0, -2.0))
    assert companion.skill.goals.goal.pos_ned[:2] == pytest.approx((4.0, -2.0), abs=0.02)


def test_the_mode_of_a_rover_can_be_chosen(page):
    flight, _ = standing(pilot=shipped_pilot("drive-reach"), world=PLAIN)
    view = LiveView(flight, page)
    chooser = next(h for h in page.gui._gui_input_handle_from_uuid.values() if h.label == "Mode")
    assert {"Hold", "Mission", "Return", "Offboard"} < set(chooser.options)
    chooser.value = "Return"
    said_after(flight, view, 0.5)
    assert flight.controller.state.mode is Mode.RETURN
