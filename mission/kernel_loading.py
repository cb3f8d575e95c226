"""The kernels of a flight, loaded before it begins: what the cache lacks is compiled, and no flight stops for it."""

from collections.abc import Sequence
from typing import Any

import warp as wp

from common.airframe import load_airframe
from common.warp_start import start_warp
from mission.console.terminal import Say
from mission.flight_config import FlightConfig
from sim.advance import advance_kernel, rig_kernels
from sim.bodies.vehicles import class_of

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
    "policies.tasks.follow_me.flown_cast",
    "policies.tasks.follow_me.image_way",
    "policies.tasks.follow_me.observe",
    "policies.tasks.flight.rollout",
    "policies.tasks.follow_me.tracked.keep_off",
    "policies.tasks.follow_me.tracked.owner_filter",
    "policies.tasks.follow_me.tracked.vector",
    "policies.tasks.flight.own_state",
)
_FOREST = ("sim.world.hills", "sim.world.growing", "sim.sensors.scanner")
_BOXES = ("sim.world.hills", "sim.world.growing", "sim.world.building")
_RING = {True: ("sim.sensors.ground_ring",), False: ("sim.sensors.ring",)}  # of what drives, of what flies
PARKING = ("policies.tasks.drive.observe", "sim.world.spots")


def flight_kernels(airframe: str) -> tuple[Any, ...]:
    """Those that are in modules of their own."""
    vehicle, body = class_of(load_airframe(airframe))
    kernels = rig_kernels(body, vehicle.law)
    advance = advance_kernel(body, vehicle.law, has_estimator=True)
    return kernels.place, kernels.power_on, kernels.forget_all_impacts, advance


def load_kernels(say: Say, config: FlightConfig, *, has_camera: bool, others: Sequence[str] = ()) -> None:
    """Loads the kernels of a flight one after the other, and says which.

    Args:
        say: is told how far it is.
        config: of the flight. With an owner those of the policy that follows too; their packages must have been
            imported.
        has_camera: those of the camera's pictures too, which a flight in lockstep loads when it takes the first.
        others: modules besides, which have been imported.
    """
    start_warp()
    drives = class_of(load_airframe(config.airframe)).drives
    names = (
        *_ALWAYS,
        *(_CAMERA if has_camera else ()),
        *(_OWNER if config.owner is not None else ()),
        *(_FOREST if config.is_forest else ()),
        *(_BOXES if config.world.has_boxes else ()),
        *(_RING[drives] if config.has_lidar else ()),
        *others,
    )
    kernels = flight_kernels(config.airframe)
    modules = [wp.get_module(name) for name in dict.fromkeys(names)] + [kernel.module for kernel in kernels]
    for number, module in enumerate(modules, 1):
        say(f"loading kernels, compiled the first time: {number} of {len(modules)}")
        wp.load_module(module, device="cpu")
