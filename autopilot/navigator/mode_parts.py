"""What the flight modes of one vehicle are built from."""

from collections.abc import Callable
from dataclasses import dataclass

from autopilot.interface.mode_spec import FlightMode
from autopilot.navigator.context import NavContext
from autopilot.navigator.fence.fence import Fence
from autopilot.navigator.fence.rally_points import RallyPoints
from autopilot.navigator.mission.mission import Mission
from autopilot.navigator.paths.breadcrumbs import Breadcrumbs


@dataclass(frozen=True, slots=True)
class ModeParts:
    """What a mode may ask for when it is built."""

    context: NavContext
    mission: Mission
    fence: Fence
    rally: RallyPoints
    crumbs: Breadcrumbs


def of_context(make: Callable[[NavContext], FlightMode]) -> Callable[[ModeParts], FlightMode]:
    """The builder of a mode that needs nothing but the context."""
    return lambda parts: make(parts.context)


def mission_mode(parts: ModeParts) -> FlightMode:
    """Mode Mission is the stored mission itself."""
    return parts.mission
