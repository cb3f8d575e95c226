"""What the commander needs of the navigator."""

from typing import Protocol

from autopilot.interface.vehicle_state import Mode
from autopilot.navigator.takeoff_intent import Ask


class Flying(Protocol):
    """The navigator, as the commander sees it."""

    def refusal(self, mode: Mode) -> str: ...

    def enter(self, mode: Mode) -> None: ...

    def begin_here(self, mode: Mode) -> None:
        """Begins a mode anew where the vehicle is, whatever clients have asked of it."""
        ...

    def on_armed(self) -> None: ...

    def arming_reason(self) -> str:
        """Why the vehicle may not take off here; empty if it may."""
        ...

    @property
    def wants_lift(self) -> bool: ...

    @property
    def is_taking_off(self) -> bool: ...

    @property
    def is_landing(self) -> bool: ...

    @property
    def has_ended(self) -> bool:
        """Whether a vehicle that stays on the ground stands where its mode was to lead it."""
        ...

    @property
    def ask(self) -> Ask:
        """Vertically, what the setpoint being flown asks for."""
        ...

    def needs_position(self, mode: Mode) -> bool:
        """Whether a mode can only be flown with a position, as its row and what it would fly now say."""
        ...

    def stream_age_us(self) -> int:
        """For how long the setpoints that the mode lives on have been silent; 0: it lives on none."""
        ...

    def tell_position(self, *, is_valid: bool) -> None: ...
