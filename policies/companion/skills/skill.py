"""What a companion can do with one kind of policy: to follow somebody, to navigate to a goal, to drive into a pose.

The companion itself (companion.py) knows the link, who flies and when setpoints are due. A skill knows its sensors, its
task, and who decides.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector
from policies.companion.guard.interventions import Interventions
from policies.companion.image_client import ImageSource
from policies.companion.telemetry import Own
from policies.companion.vehicle_link import VehicleLink
from policies.tasks.layout import Layout

Floats = NDArray[np.float32]
Velocity = tuple[Vector, float]
"""A velocity [m/s] in ned, or ahead, right and down; and a yaw rate [rad/s], NaN: none is asked for."""


class Skill(Protocol):
    """One kind of policy in flight. Times are on the companion's clock unless they are said to be the vehicle's."""

    ready: str  # what a pilot is told when it could fly: "ready to follow"
    flying: str  # and while it does: "following"
    drives: bool  # ground vehicles, and flies none
    is_along_nose: bool  # its velocities are ahead, right and down
    action_size: int
    return_s: float  # after so long in Hold without whom it has lost the vehicle is sent home; 0: never
    resume_s: float  # so long after a lost position it may go on by itself; 0: never
    seen: Floats  # the vector that was decided on last
    wanted: Velocity  # what the last action asked for, before a guard
    stances: tuple[str, ...]  # that its guard may take; a log keeps their places: new ones go to the end

    @property
    def camera(self) -> ImageSource | None:
        """What it sees by; None: by ranges alone."""
        ...

    @property
    def interventions(self) -> Interventions | None:
        """How many decisions its guard has changed, by the reason; None: it has no guard."""
        ...

    @property
    def stance(self) -> str:
        """Of its guard at the newest decision; "": it has none."""
        ...

    def attach(self, vehicle: VehicleLink) -> None:
        """Says what it has to hear; once, before anything is received."""
        ...

    def receive(self, vehicle: VehicleLink, time_us: int, *, is_flying: bool) -> bool:
        """Takes in what its sensors and its clients have sent; whether there is something new to decide on."""
        ...

    def is_ordered(self) -> bool:
        """Whether somebody has asked it to fly since the last call, other than by choosing Offboard."""
        ...

    def blindness(self, own: Own, time_us: int, *, is_flying: bool) -> str:
        """Why there is nothing to decide on; "" if there is."""
        ...

    def loss(self, own: Own, *, is_flying: bool) -> str:
        """Why it cannot fly, or need not any more, though it sees; "" if it can."""
        ...

    def is_alone(self, own: Own) -> bool:
        """Whether who is followed is not seen now."""
        ...

    def is_covered(self, own: Own) -> bool:
        """Whether something was seen over the vehicle."""
        ...

    @property
    def is_by_sight(self) -> bool:
        """Whether GNSS is away, so that the vehicle knows its place by what was flown since."""
        ...

    def begin(self, own: Own) -> None:
        """It takes over: an episode begins, as in training, without memory."""
        ...

    def decide(self, own: Own, last_action: Floats, time_us: int, *, is_flying: bool) -> Floats | None:
        """The action on what was received last, in [-1, 1]; None if none was due, or none came out as a number.

        Args:
            own: telemetry.
            last_action: as it was flown.
            time_us: the companion's own clock.
            is_flying: the companion flies.
        """
        ...

    def setpoint(self, action: Floats, own: Own) -> Velocity:
        """What an action asks for, as its guard lets it."""
        ...

    def action_of(self, flown: Velocity, own: Own, action: Floats) -> Floats:
        """The action that asks for what was flown in the place of another."""
        ...

    def conclude(self, own: Own) -> None:
        """Called after the setpoint has been sent, when something new was received: nobody waits for it."""
        ...

    @property
    def record_layout(self) -> Layout:
        """Of what `recorded_frame` gives, one frame in a stack."""
        ...

    @property
    def image_layout(self) -> Layout | None:
        """Of `seen` and `recorded_image` together, where its pilot decides on both; None: it decides on no image."""
        ...

    def keep_records(self) -> None:
        """Its decisions will be noted; before anything is received."""
        ...

    def recorded_frame(self, own: Own, flown: Velocity, time_us: int, *, is_flying: bool) -> Floats:
        """The newest frame of what the last decision was made on, or would have been; called once after each.

        Args:
            own: telemetry.
            flown: what was sent after it, or how the vehicle moves.
            time_us: the companion's own clock.
            is_flying: the companion flies.
        """
        ...

    def recorded_goal(self, own: Own) -> Vector:
        """Where it goes: north, east [m], and down [m] or the heading there [rad]; NaN: nowhere."""
        ...

    def recorded_image(self) -> NDArray[np.uint8] | None:
        """The image that was looked at; None: none was."""
        ...

    def hint(self, trouble: str) -> str:
        """What more is known of why there is this trouble; "" if nothing is."""
        ...

    def figures(self, own: Own, time_us: int) -> str:
        """Its figures of now, for a line of progress."""
        ...

    def close(self) -> None: ...
