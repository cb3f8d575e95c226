"""The steps of a scenario's script, asked of the flight controller itself instead of over MAVLink.

A step is a generator that goes on once a frame. An order takes effect at the end of the next frame, as a message does
that a client sends.
"""

from collections.abc import Callable, Iterator
from math import dist, nan, radians
from typing import Any

from autopilot.interface.client_requests import ChangeMode, ChangeSpeed, GoTo, LandAt, TakeOff
from autopilot.interface.vehicle_state import LandedState, Mode, Reply, Verdict
from common.geodesy import geodetic_from_ned
from mission.client import ScriptError
from mission.scenario.flight.run import Run, VehicleRun
from mission.scenario.parts import steps as s

HEIGHT_WITHIN_M = 0.3  # as mission.script.Drone.takeoff
READY_S, ARMED_S, MODE_S = 60.0, 2.0, 3.0
Steps = Iterator[float]
"""Yields once a frame the time [s] until which nothing is to be decided; 0: look each frame."""


def fly(run: Run, vehicle: VehicleRun) -> Steps:
    """Does the steps, once the vehicle is ready.

    Raises:
        ScriptError: a step failed; the message says which.
    """
    state = vehicle.flight.controller.state
    try:
        yield from _until(vehicle, lambda: state.is_ready_to_arm and state.home is not None, READY_S, "ready to arm")
    except ScriptError as error:
        reasons = ", ".join(vehicle.flight.controller.check_arming())
        raise ScriptError(": ".join(filter(None, (str(error), reasons)))) from error
    for number, step in enumerate(vehicle.config.script, 1):
        try:
            yield from STEPS[step.name_chosen](run, vehicle, step.chosen)
        except ScriptError as error:
            raise ScriptError(f"step {number}, {step.name_chosen}: {error}") from error


def _now_s(vehicle: VehicleRun) -> float:
    return vehicle.flight.time_us * 1e-6


def _until(vehicle: VehicleRun, condition: Callable[[], bool], timeout_s: float, what: str) -> Steps:
    end_s = _now_s(vehicle) + timeout_s
    while not condition():
        if _now_s(vehicle) >= end_s:
            raise ScriptError(f"{what}: nothing within {timeout_s:g} s")
        yield 0.0


def _order(name: str, give: Callable[[], Reply]) -> Steps:
    yield 0.0
    reply = give()
    if reply.verdict is not Verdict.ACCEPTED:
        raise ScriptError(f"{name}: {reply.verdict.name.lower()}: {reply.reason}")


def _arm(_: Run, vehicle: VehicleRun, step: s.Arm) -> Steps:
    controller = vehicle.flight.controller
    yield from _order("arm", lambda: controller.arm(force=step.force))
    yield from _until(vehicle, lambda: controller.state.is_armed, ARMED_S, "armed")


def _takeoff(_: Run, vehicle: VehicleRun, step: s.Takeoff) -> Steps:
    controller, home = vehicle.flight.controller, vehicle.flight.controller.state.home
    yield from _order("takeoff", lambda: controller.request(TakeOff(home.alt_m + step.height_m)))
    down = _home_down(vehicle) - step.height_m

    def is_there() -> bool:
        return abs(float(controller.state.estimate.pos_ned[2]) - down) < HEIGHT_WITHIN_M

    yield from _until(vehicle, is_there, step.timeout_s, f"takeoff to {step.height_m:g} m")
    yield from _until(vehicle, lambda: controller.state.mode is Mode.HOLD, step.timeout_s, "hold after takeoff")


def _home_down(vehicle: VehicleRun) -> float:
    state = vehicle.flight.controller.state
    return float(state.origin.alt_m - state.home.alt_m)


def _goto_ned(_: Run, vehicle: VehicleRun, step: s.GotoNed) -> Steps:
    controller = vehicle.flight.controller
    lat_deg, lon_deg, alt_m = geodetic_from_ned(*step.to, controller.state.origin)
    yaw = nan if step.yaw_deg is None else radians(step.yaw_deg)
    speed = nan if step.speed_m_s is None else step.speed_m_s
    asked = GoTo(round(lat_deg * 1e7) * 1e-7, round(lon_deg * 1e7) * 1e-7, alt_m, yaw, speed)
    yield from _order("goto", lambda: controller.request(asked))
    what = f"goto {step.to}"
    yield from _until(
        vehicle, lambda: dist(controller.state.estimate.pos_ned, step.to) < step.within_m, step.timeout_s, what
    )


def _hold(run: Run, vehicle: VehicleRun, step: s.Hold) -> Steps:
    yield from _mode(vehicle, Mode.HOLD)
    yield from _wait(run, vehicle, s.Wait(for_s=step.for_s))


def _mode(vehicle: VehicleRun, mode: Mode) -> Steps:
    controller = vehicle.flight.controller
    yield from _order(mode.name.lower(), lambda: controller.request(ChangeMode(mode)))
    yield from _until(vehicle, lambda: controller.state.mode is mode, MODE_S, f"mode {mode.name.lower()}")


def _wait(_: Run, vehicle: VehicleRun, step: s.Wait) -> Steps:
    end_s = _now_s(vehicle) + step.for_s
    while _now_s(vehicle) < end_s:
        yield end_s


def _speed(_: Run, vehicle: VehicleRun, step: s.Speed) -> Steps:
    yield from _order("change speed", lambda: vehicle.flight.controller.request(ChangeSpeed(step.m_s)))


def _mark(run: Run, _: VehicleRun, step: s.Mark) -> Steps:
    run.mark(step.name)
    yield from ()


def _land(run: Run, vehicle: VehicleRun, step: s.Land) -> Steps:
    yield from _order("land", lambda: vehicle.flight.controller.request(LandAt()))
    yield from _wait_disarmed(run, vehicle, s.WaitDisarmed(timeout_s=step.timeout_s))


def _return_home(run: Run, vehicle: VehicleRun, step: s.ReturnHome) -> Steps:
    yield from _mode(vehicle, Mode.RETURN)
    yield from _wait_disarmed(run, vehicle, s.WaitDisarmed(timeout_s=step.timeout_s))


def _wait_disarmed(_: Run, vehicle: VehicleRun, step: s.WaitDisarmed) -> Steps:
    state = vehicle.flight.controller.state

    def is_down() -> bool:
        return not state.is_armed and state.landed_state is LandedState.ON_GROUND

    yield from _until(vehicle, is_down, step.timeout_s, "landed and disarmed")


STEPS: dict[str, Callable[[Run, VehicleRun, Any], Steps]] = {
    "arm": _arm,
    "takeoff": _takeoff,
    "goto_ned": _goto_ned,
    "hold": _hold,
    "wait": _wait,
    "speed": _speed,
    "mark": _mark,
    "land": _land,
    "return_home": _return_home,
    "wait_disarmed": _wait_disarmed,
}
