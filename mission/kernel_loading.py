"""The kernels of a flight, loaded before it begins: what the cache lacks is compiled, and no flight stops for it."""

from typing import Any

import warp as wp

from common.warp_start import start_warp
from mission.console.terminal import Say
from sim.advance import advance_kernel, rig_kernels
from sim.bodies.body import DEFAULT_BODY, DEFAULT_LAW

_ALWAYS = ("autopilot.estimator.ekf",)
_CAMERA = ("sim.sensors.camera",)
_OWNER = (
    "sim.world.hills",
    "sim.world.growing",
    "sim.walking_owner",
    "sim.sensors.fast_camera.prepare",
    "sim.sensors.fast_camera.columns",
    "sim.sensors.fast_camera.rows",
    "sim.sensors.fast_camera.optics",
    "sim.sensors.fast_camera.ground",
    "sim.sensors.fast_camera.light",
    "policies.tasks.follow_me.task_cameras",
    "policies.tasks.follow_me.observe",
    "policies.tasks.flight.own_state",
)
_FOREST = ("sim.world.hills", "sim.world.growing", "sim.sensors.scanner")


def flight_kernels() -> tuple[Any, ...]:
    """Those that are in modules of their own."""
    vehicle = DEFAULT_BODY, DEFAULT_LAW
    kernels = rig_kernels(*vehicle)
    return kernels.place, kernels.power_on, kernels.forget_all_impacts, advance_kernel(*vehicle, has_estimator=True)


def load_kernels(say: Say, *, has_camera: bool, has_owner: bool, has_forest: bool = False) -> None:
    """Loads the kernels of a flight one after the other, and says which.

    Args:
        say: is told how far it is.
        has_camera: those of the camera's pictures too, which a flight in lockstep loads when it takes the first.
        has_owner: those of the owner and of the policy that follows too; their packages must have been imported.
        has_forest: those of growing a forest and of the scanner.
    """
    start_warp()
    names = (
        *_ALWAYS,
        *(_CAMERA if has_camera else ()),
        *(_OWNER if has_owner else ()),
        *(_FOREST if has_forest else ()),
    )
    modules = [wp.get_module(name) for name in names] + [kernel.module for kernel in flight_kernels()]
    for number, module in enumerate(modules, 1):
        say(f"loading kernels, compiled the first time: {number} of {len(modules)}")
        wp.load_module(module, device="cpu")
