"""The steps of a script, done over MAVLink by the vehicle's scripting client.

In: a vehicle of a run and its steps. Out: a coroutine that ends when they are done, or with the first that fails.
"""

from collections.abc import Awaitable, Callable, Sequence
from math import nan, radians
from typing import Any

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects.px4 import PX4
from mission.client import ScriptError
from mission.plan.plan_file import Plan, PlanError, read_plan
from mission.plan.plan_lists import FENCE_LIST
from mission.scenario.flight.inline_plans import fence_plan_items, path_plan, survey_plan
from mission.scenario.flight.quantities import hold_now
from mission.scenario.flight.run import Run, VehicleRun
from mission.scenario.flight.target_camera import send_sightings
from mission.scenario.parts import steps as s
from mission.scenario.parts.conditions import terms_of
from mission.script import fly_plan, start_plan

STICKS_S = 0.05


async def fly_steps(run: Run, vehicle: VehicleRun, steps: Sequence[s.Step]) -> None:
    """Does the steps, once the vehicle is ready.

    Raises:
        ScriptError: a step failed; the message says which.
    """
    await vehicle.drone.wait_ready()
    for number, step in enumerate(steps, 1):
        try:
            await ACTIONS[step.name_chosen](run, vehicle, step.chosen)
        except ScriptError as error:
            raise ScriptError(f"step {number}, {step.name_chosen}: {error}") from error


def _yaw(yaw_deg: float | None) -> float:
    return nan if yaw_deg is None else radians(yaw_deg)


async def _arm(_: Run, vehicle: VehicleRun, step: s.Arm) -> None:
    await vehicle.drone.arm(force=step.force)


async def _disarm(_: Run, vehicle: VehicleRun, step: s.Disarm) -> None:
    await vehicle.drone.disarm(force=step.force)


async def _takeoff(_: Run, vehicle: VehicleRun, step: s.Takeoff) -> None:
    await vehicle.drone.takeoff(step.height_m, timeout_s=step.timeout_s)


async def _goto_ned(_: Run, vehicle: VehicleRun, step: s.GotoNed) -> None:
    await vehicle.drone.goto_ned(
        *step.to,
        yaw_rad=_yaw(step.yaw_deg),
        speed_m_s=-1.0 if step.speed_m_s is None else step.speed_m_s,
        acceptance_m=step.within_m,
        timeout_s=step.timeout_s,
    )


async def _hold(_: Run, vehicle: VehicleRun, step: s.Hold) -> None:
    await vehicle.drone.hold()
    await vehicle.drone.sleep(step.for_s)


async def _wait(_: Run, vehicle: VehicleRun, step: s.Wait) -> None:
    await vehicle.drone.sleep(step.for_s)


async def _wait_until(_: Run, vehicle: VehicleRun, step: s.WaitUntil) -> None:
    terms, flight = terms_of(step.condition), vehicle.flight
    await vehicle.drone.until(lambda: hold_now(flight, terms), step.timeout_s, step.condition)


async def _wait_disarmed(_: Run, vehicle: VehicleRun, step: s.WaitDisarmed) -> None:
    await vehicle.drone.wait_disarmed(step.timeout_s)


async def _velocity(_: Run, vehicle: VehicleRun, step: s.Velocity) -> None:
    vehicle.drone.offboard_velocity(*step.ned_m_s, _yaw(step.yaw_deg))
    await _offboard(vehicle, step.for_s)


async def _position(_: Run, vehicle: VehicleRun, step: s.Position) -> None:
    vehicle.drone.offboard_position(*step.ned, _yaw(step.yaw_deg))
    await _offboard(vehicle, step.for_s)


async def _offboard(vehicle: VehicleRun, for_s: float) -> None:
    await vehicle.drone.start_offboard()
    await vehicle.drone.sleep(for_s)
    await vehicle.drone.stop_offboard()


async def _land(_: Run, vehicle: VehicleRun, step: s.Land) -> None:
    await vehicle.drone.land(step.timeout_s)


async def _precision_land(run: Run, vehicle: VehicleRun, step: s.PrecisionLand) -> None:
    await _set_mode(run, vehicle, s.SetMode(mode="precision_land"))
    await send_sightings(run, vehicle, step)
    if step.until is None:
        await vehicle.drone.wait_disarmed(1.0)


async def _return_home(_: Run, vehicle: VehicleRun, step: s.ReturnHome) -> None:
    await vehicle.drone.return_home()
    await vehicle.drone.wait_disarmed(step.timeout_s)


async def _mission(vehicle: VehicleRun, plan: Plan, *, waits: bool) -> None:
    vehicle.plan = plan
    if waits:
        await fly_plan(vehicle.drone, plan)
    else:
        await start_plan(vehicle.drone, plan)


async def _fly_plan(_: Run, vehicle: VehicleRun, step: s.FlyPlan) -> None:
    try:
        plan = read_plan(step.file)
    except PlanError as error:
        raise ScriptError(str(error)) from error
    await _mission(vehicle, plan, waits=step.waits)


async def _fly_path(_: Run, vehicle: VehicleRun, step: s.FlyPath) -> None:
    flight = vehicle.flight
    plan = path_plan(step, flight.config.home, drives=flight.drives, start_ne_m=flight.config.start_ne_m)
    await _mission(vehicle, plan, waits=step.waits)


async def _survey(_: Run, vehicle: VehicleRun, step: s.Survey) -> None:
    plan = survey_plan(step, vehicle.flight.config.home, drives=vehicle.flight.drives)
    await _mission(vehicle, plan, waits=step.waits)


async def _fence(_: Run, vehicle: VehicleRun, step: s.Fence) -> None:
    await vehicle.drone.upload(fence_plan_items(step, vehicle.flight.config.home), FENCE_LIST)


async def _set_mode(_: Run, vehicle: VehicleRun, step: s.SetMode) -> None:
    await vehicle.drone.choose_mode(PX4.custom_mode(Mode[step.mode.upper()]), step.mode)


async def _speed(_: Run, vehicle: VehicleRun, step: s.Speed) -> None:
    await vehicle.drone.change_speed(step.m_s)


async def _set_param(_: Run, vehicle: VehicleRun, values: dict[str, float]) -> None:
    for name, value in values.items():
        stored = await vehicle.drone.set_parameter(name, value)
        if abs(stored - value) > 1e-5 * max(1.0, abs(value)):
            raise ScriptError(f"{name} = {value:g}: the vehicle took {stored:g}")


async def _mark(run: Run, _: VehicleRun, step: s.Mark) -> None:
    run.mark(step.name)


async def _sticks(_: Run, vehicle: VehicleRun, step: s.Sticks) -> None:
    if vehicle.sticks is None:
        vehicle.drone.start(_send_sticks(vehicle))
    vehicle.sticks = (step.roll, step.pitch, step.yaw, step.throttle)
    await vehicle.drone.sleep(step.for_s)
    vehicle.sticks = (0.0, 0.0, 0.0, 0.0)


async def _send_sticks(vehicle: VehicleRun) -> None:
    while True:
        roll, pitch, yaw, throttle = vehicle.sticks or (0.0, 0.0, 0.0, 0.0)
        vehicle.drone.send(
            "MANUAL_CONTROL", target=1, x=round(1000 * pitch), y=round(1000 * roll), z=round(500 + 500 * throttle),
            r=round(1000 * yaw), buttons=0,
        )  # fmt: skip
        await vehicle.drone.sleep(STICKS_S)


async def _by_policy(name: str, run: Run, vehicle: VehicleRun, step: Any) -> None:
    if run.companion is None:
        raise ScriptError("the vehicle has no policy")
    from mission.scenario.flight import policy_steps

    action: Callable[..., Awaitable[None]] = getattr(policy_steps, name)
    await action(run, vehicle, step)


async def _let_policy_fly(run: Run, vehicle: VehicleRun, step: s.LetPolicyFly) -> None:
    await _by_policy("follow", run, vehicle, step)


async def _policy_goto(run: Run, vehicle: VehicleRun, step: s.PolicyGoto) -> None:
    await _by_policy("go", run, vehicle, step)


async def _policy_park(run: Run, vehicle: VehicleRun, step: s.PolicyPark) -> None:
    await _by_policy("park", run, vehicle, step)


ACTIONS: dict[str, Callable[[Run, VehicleRun, Any], Awaitable[None]]] = {
    "arm": _arm,
    "disarm": _disarm,
    "takeoff": _takeoff,
    "goto_ned": _goto_ned,
    "hold": _hold,
    "wait": _wait,
    "wait_until": _wait_until,
    "wait_disarmed": _wait_disarmed,
    "velocity": _velocity,
    "position": _position,
    "land": _land,
    "precision_land": _precision_land,
    "return_home": _return_home,
    "fly_plan": _fly_plan,
    "fly_path": _fly_path,
    "survey": _survey,
    "fence": _fence,
    "set_mode": _set_mode,
    "speed": _speed,
    "set_param": _set_param,
    "mark": _mark,
    "sticks": _sticks,
    "let_policy_fly": _let_policy_fly,
    "policy_goto": _policy_goto,
    "policy_park": _policy_park,
}
