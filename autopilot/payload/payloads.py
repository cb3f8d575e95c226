"""Payload: what the vehicle carries and does not fly with, such as camera, gimbal, gripper, relays.

A part of the payload says which commands it takes (numbered as MAV_CMD) and carries them out; a mission item whose
command no part takes is refused when the mission is uploaded.
"""

from typing import Protocol

from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict

Params = tuple[float, float, float, float]


class Payload(Protocol):
    """One part of the payload."""

    def takes(self, command: int) -> bool:
        """Whether it carries out a command, whatever the parameters."""
        ...

    def run(self, command: int, params: Params, x: float, y: float, z: float) -> Reply:
        """Carries a command out.

        Args:
            command: MAV_CMD.
            params: parameters 1 to 4.
            x: parameter 5; latitude [deg] where the command has a position.
            y: parameter 6; longitude [deg] likewise.
            z: parameter 7; altitude above sea level [m] likewise.
        """
        ...


class Payloads:
    """Everything the vehicle carries, as one payload."""

    __slots__ = ("_parts",)

    def __init__(self) -> None:
        self._parts: list[Payload] = []

    def add(self, part: Payload) -> None:
        self._parts.append(part)

    def takes(self, command: int) -> bool:
        return any(part.takes(command) for part in self._parts)

    def run(self, command: int, params: Params, x: float, y: float, z: float) -> Reply:
        """Has every part that takes the command carry it out; the first refusal, if there is one."""
        takers = [part for part in self._parts if part.takes(command)]
        if not takers:
            return Reply(Verdict.UNSUPPORTED, "no payload takes this command")
        replies = [part.run(command, params, x, y, z) for part in takers]
        return next((reply for reply in replies if reply.verdict is not Verdict.ACCEPTED), ACCEPTED)
