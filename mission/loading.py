"""The kernels of a flight, loaded before it begins: what the cache lacks is compiled, and no flight stops for it."""

import warp as wp

from mission.terminal import Say
from sim.rig import advance_kernel

_ALWAYS = ("autopilot.estimator.ekf", "sim.advance")
_CAMERA = ("sim.sensors.camera",)
_OWNER = (
    "sim.world.hills", "sim.world.growing", "sim.owner", "sim.sensors.quick.prepare", "sim.sensors.quick.columns",
    "sim.sensors.quick.rows", "sim.sensors.quick.optics", "sim.sensors.quick.ground", "sim.sensors.quick.light",
    "policies.tasks.follow_me.images", "policies.tasks.follow_me.observe", "policies.tasks.flight.own",
)  # fmt: skip


def load_kernels(say: Say, *, has_camera: bool, has_owner: bool) -> None:
    """Loads the kernels of a flight one after the other, and says which.

    Args:
        say: is told how far it is.
        has_camera: those of the camera's pictures too, which a flight in lockstep loads when it takes the first.
        has_owner: those of the owner and of the policy that follows too; their packages must have been imported.
    """
    names = (*_ALWAYS, *(_CAMERA if has_camera else ()), *(_OWNER if has_owner else ()))
    modules = [*(wp.get_module(name) for name in names), advance_kernel(has_estimator=True).module]
    for number, module in enumerate(modules, 1):
        say(f"loading kernels, compiled the first time: {number} of {len(modules)}")
        wp.load_module(module, device="cpu")
