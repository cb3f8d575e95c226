"""What a rig asks of whoever flies its vehicles: samples in, motor commands out."""

from typing import Any, Protocol


class Board(Protocol):
    """Flies every vehicle of a rig; made for it."""

    is_fast: bool
    """It exchanges after each millisecond, with the samples of the tick before and the truth of that millisecond."""

    def boot(self, is_chosen: Any) -> None:
        """Powers flight controllers off and on.

        Args:
            is_chosen: array of int, (vehicles,); not 0: this one.
        """

    def give(self, samples: Any, truth: Any) -> None:
        """Gives each flight controller what its sensors have delivered, once per tick of 4 ms.

        Args:
            samples: array of `Samples`, (vehicles,).
            truth: array of `Truth`, (vehicles,): for simulators that an outside autopilot brings along; not ours.
        """

    def take(self, commands: Any) -> None:
        """Takes its commands, after each `give`; other rigs may have gone on in between, while it computed.

        Args:
            commands: array of vec8, (vehicles,), to be written: [0..1] of the motors.
        """
