"""What a rig asks of whoever moves its bodies: motor commands and wind in, truth out."""

from typing import Any, Protocol


class Engine(Protocol):
    """Moves every vehicle of a rig; made for it, and writes its rows of `Truth`."""

    def boot(self, is_chosen: Any) -> None:
        """Puts vehicles on the ground at home, at rest.

        Args:
            is_chosen: array of int, (vehicles,); not 0: this one.
        """

    def step(self, commands: Any, wind_ned: Any) -> None:
        """Moves them by one tick of 4 ms and writes their truth at its end.

        Args:
            commands: of the motors [0..1], array of vec8, (vehicles,); what faults take away is taken away.
            wind_ned: [m/s] at each vehicle, array of vec3, (vehicles,).
        """


class FastEngine(Engine, Protocol):
    """One that can be stopped after each millisecond: for boards that exchange at 1,000 Hz."""

    def substep(self, commands: Any, wind_ned: Any) -> None:
        """As `step`, a millisecond of bodies that have a `substep`."""
