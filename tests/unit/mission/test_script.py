"""What a script can ask of the vehicle, each over MAVLink in memory with perfect sensors."""

from dataclasses import replace
from math import hypot, nan, pi

import pytest

from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import Mode
from common.geodesy import DEFAULT_HOME, GeoPoint, geodetic_from_ned
from mission.client import CommandRefused, ScriptError, ScriptTimeout
from mission.flight import Flight, FlightConfig
from mission.plan.plan_file import FenceCircle, FencePolygon, Plan, PlanItem
from mission.script import fly_plan
from sim.faults import set_fault
from sim.world.world import WorldConfig

CONFIG = FlightConfig(noise=0.0, world=WorldConfig(trees_per_ha=0.0, hill_height_m=0.0))
WAYPOINT, RETURN, LAND, TAKEOFF, SPEED, JUMP = 16, 20, 21, 22, 178, 177


@pytest.fixture
def flight():
    flight = Flight(CONFIG)
    yield flight
    flight.close()


def result_of(flight, script, seconds=300.0):
    """What the script returned; raises its error."""
    running = flight.fly(script, seconds=seconds)
    if running.error is not None:
        raise running.error
    return running.result


def true_ned(flight):
    return [float(x) for x in flight.rig.rows["truth"]["pos_ned"][0]]


def item(seq, command, north=0.0, east=0.0, height=10.0, params=(0.0, 0.0, 0.0, nan)):
    latitude, longitude, _ = geodetic_from_ned(north, east, 0.0, DEFAULT_HOME)
    return PlanItem(seq, 3, command, params, latitude, longitude, height)


def test_takeoff_goto_and_land(flight):
    async def script(drone):
        assert not drone.is_armed
        await drone.wait_ready()
        assert drone.is_landed
        await drone.arm()
        await drone.takeoff(12.0)
        assert true_ned(flight)[2] == pytest.approx(-12.0, abs=0.5)
        await drone.goto_ned(10.0, -5.0, -8.0, yaw_rad=1.0, speed_m_s=3.0)
        assert true_ned(flight) == pytest.approx([10.0, -5.0, -8.0], abs=0.6)
        await drone.land()

    result_of(flight, script)
    assert not flight.controller.state.is_armed
    assert true_ned(flight)[:2] == pytest.approx([10.0, -5.0], abs=0.5)
    assert flight.controller.state.yaw_rad == pytest.approx(1.0, abs=0.1)


def test_why_it_may_not_be_armed_is_what_its_checks_say(flight):
    async def script(drone):
        drone.texts.append("PreArm: said before")
        told = drone.sleep

        async def told_meanwhile(seconds):
            await told(seconds)
            drone.texts.extend(["Companion: searching", "PreArm: no GNSS fix"])

        drone.sleep = told_meanwhile
        with pytest.raises(ScriptTimeout) as timeout:
            await drone.wait_ready(0.0)
        return str(timeout.value)

    reasons = result_of(flight, script).partition("ready to arm")[2]
    assert reasons.endswith("no GNSS fix")
    assert "Companion" not in reasons
    assert "said before" not in reasons


def test_goto_returns_only_when_it_is_there(flight):
    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(5.0)
        with pytest.raises(ScriptTimeout, match="goto"):
            await drone.goto_ned(100.0, 0.0, -5.0, timeout_s=2.0)
        await drone.hold()
        await drone.sleep(4.0)
        return drone.vel_ned

    assert hypot(*result_of(flight, script)) < 0.1


def test_offboard_position_velocity_attitude_and_rates(flight):
    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(10.0)
        with pytest.raises(ScriptError, match="set an offboard setpoint first"):
            await drone.start_offboard()
        drone.offboard_position(3.0, 4.0, -12.0, 0.5)
        await drone.start_offboard()
        await drone.sleep(6.0)
        assert true_ned(flight) == pytest.approx([3.0, 4.0, -12.0], abs=0.2)
        drone.offboard_velocity(1.0, -1.0, -0.5)
        await drone.sleep(4.0)
        assert drone.vel_ned == pytest.approx((1.0, -1.0, -0.5), abs=0.15)
        drone.offboard_velocity(2.0, 0.0, 0.0, frame=8)  # forward: the heading is still 0.5 rad
        await drone.sleep(4.0)
        assert drone.vel_ned == pytest.approx((1.755, 0.959, 0.0), abs=0.15)
        hover = drone.latest("ATTITUDE_TARGET").thrust
        drone.offboard_attitude((0.9962, 0.0, -0.0872, 0.0), hover)  # 10 degrees nose down
        await drone.sleep(1.5)
        assert drone.latest("ATTITUDE").pitch == pytest.approx(-10.0 * pi / 180.0, abs=0.03)
        drone.offboard_rates((0.0, 0.0, 0.6), hover)
        await drone.sleep(1.0)
        assert drone.latest("ATTITUDE").yawspeed == pytest.approx(0.6, abs=0.05)
        await drone.stop_offboard()
        await drone.sleep(5.0)

    result_of(flight, script)
    assert flight.controller.state.mode is Mode.HOLD
    assert flight.drone._offboard is None


def test_mission_is_paused_and_resumed(flight):
    items = [item(0, TAKEOFF), item(1, WAYPOINT, 30.0), item(2, WAYPOINT, 30.0, 20.0)]

    async def script(drone):
        await drone.wait_ready()
        await drone.upload(items)
        assert len(await drone.download()) == 3
        await drone.start_mission()
        await drone.until(lambda: drone.pos_ned[0] > 8.0, 60.0, "on its way")
        await drone.pause_mission()
        await drone.sleep(5.0)
        assert hypot(*drone.vel_ned) < 0.1
        assert drone.reached == [0]
        await drone.change_speed(3.0)
        await drone.resume_mission()
        await drone.wait_mission_finished(2)
        assert drone.reached == [0, 1, 2]
        await drone.start_mission()
        assert drone.reached == []
        await drone.return_home()
        await drone.wait_disarmed()

    result_of(flight, script)
    assert true_ned(flight)[:2] == pytest.approx([0.0, 0.0], abs=0.5)


def test_refusal_carries_the_vehicles_reason(flight):
    async def script(drone):
        await drone.wait_ready()
        with pytest.raises(CommandRefused, match=r"goto refused \(result 1\): Goto: not in the air"):
            await drone.goto_ned(1.0, 1.0, -5.0)
        with pytest.raises(CommandRefused, match=r"start mission refused .* no mission is loaded"):
            await drone.start_mission()
        await drone.arm()
        await drone.takeoff(5.0)
        with pytest.raises(CommandRefused, match=r"disarm refused .* in the air"):
            await drone.disarm()
        return True

    assert result_of(flight, script)


def test_arming_before_the_vehicle_is_ready_is_refused_and_can_be_forced(flight):
    async def script(drone):
        with pytest.raises(ScriptError, match="no home position yet"):
            _ = drone.home
        with pytest.raises(CommandRefused, match="arm refused"):
            await drone.arm()
        await drone.arm(force=True)
        await drone.disarm()
        return True

    assert result_of(flight, script, 5.0)


def test_fence_and_rally_points_of_a_plan_are_uploaded_with_it(flight):
    plan = Plan(
        (item(0, TAKEOFF), item(1, LAND, 0.0, 0.0, 0.0)),
        fence=(
            FenceCircle(DEFAULT_HOME.lat_deg, DEFAULT_HOME.lon_deg, 300.0, is_inclusion=True),
            FencePolygon(((47.3, 8.5), (47.3, 8.51), (47.31, 8.5)), is_inclusion=False),
        ),
        rally=(GeoPoint(DEFAULT_HOME.lat_deg + 1e-4, DEFAULT_HOME.lon_deg, 20.0),),
    )
    result_of(flight, lambda drone: fly_plan(drone, plan))
    lists = flight.controller.lists
    assert [entry.command for entry in lists.items(ListKind.FENCE)] == [5003, 5002, 5002, 5002]
    assert [(entry.frame, entry.z) for entry in lists.items(ListKind.RALLY)] == [(3, 20.0)]


@pytest.mark.parametrize("last", [LAND, RETURN])
def test_plan_that_ends_on_the_ground_is_flown_until_the_motors_stop(flight, last):
    plan = Plan((item(0, TAKEOFF), item(1, WAYPOINT, 10.0), item(2, last, 10.0, 0.0, 0.0)))
    result_of(flight, lambda drone: fly_plan(drone, plan))
    assert not flight.controller.state.is_armed
    assert true_ned(flight)[0] == pytest.approx(10.0 if last == LAND else 0.0, abs=0.5)


def test_plan_that_ends_in_the_air_is_flown_to_its_last_item(flight):
    items = (item(0, TAKEOFF), item(1, WAYPOINT, 10.0), item(2, JUMP, params=(1.0, 1.0, 0.0, 0.0)))
    plan = Plan((*items[:2], replace(items[2], frame=2, x=0.0, y=0.0, z=0.0), item(3, WAYPOINT, 0.0, 5.0)))
    result_of(flight, lambda drone: fly_plan(drone, plan))
    assert flight.controller.state.is_armed
    assert true_ned(flight)[1] == pytest.approx(5.0, abs=2.5)


def test_plan_whose_flight_ends_elsewhere_has_failed(flight):
    plan = Plan((item(0, TAKEOFF), item(1, WAYPOINT, 60.0), item(2, LAND, 60.0, 0.0, 0.0)))

    async def script(drone):
        flying = drone.start(fly_plan(drone, plan))
        await drone.until(lambda: drone.pos_ned[0] > 10.0, 60.0, "on its way")
        set_fault(flight.rig.arrays.faults.numpy()[0], "gnss", "off")
        await drone.until(lambda: flying.is_done, 200.0, "done")
        return flying.error

    error = result_of(flight, script)
    assert str(error).startswith("the flight ended before the mission did at item 2 (")
    assert "Position lost" in str(error)


def test_parameter_is_read_and_set(flight):
    async def script(drone):
        assert await drone.set_parameter("MPC_XY_CRUISE", 3.5) == 3.5
        assert await drone.get_parameter("SYS_AUTOSTART") == 4001.0
        return await drone.get_parameter("MPC_XY_CRUISE")

    assert result_of(flight, script, 5.0) == 3.5
    assert flight.controller.params["MPC_XY_CRUISE"] == 3.5
