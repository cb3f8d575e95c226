"""Rig of the tests of following: flights in the world of follow-me, in lockstep."""

from autopilot.mavlink.wire.codec import FrameReader
from mission.flight import FlightConfig
from mission.flight_config import OwnerConfig
from mission.follow.lockstep import flight_with_companion
from mission.script import take_off
from policies.companion.engagement import Phase
from policies.companion.guard.settings import GuardSettings
from policies.experts.follower import ScriptedFollower
from policies.tasks.follow_me.world import FOLLOW_WORLD


def config(pace="walk", seed=3, **owner):
    return FlightConfig(owner=OwnerConfig(pace=pace, **owner), world=FOLLOW_WORLD, seed=seed)


def following(
    folder=None,
    *,
    pace="walk",
    seed=3,
    pilot=None,
    has_guard=True,
    settings=None,
    dialect="px4",
    links=(),
    parameters=None,
    **owner,
):
    """A flight that follows, and its companion."""
    guard = GuardSettings(is_on=has_guard, **(settings or {}))
    made = config(pace, seed, **owner).model_copy(update={"dialect": dialect, "parameters": parameters or {}})
    flight, companion = flight_with_companion(
        made, pilot or ScriptedFollower(), links=links, folder=folder, guard=guard
    )
    flight.fly(take_off, seconds=40.0)
    advance(flight, 5.0, lambda: companion.phase is Phase.FLYING)
    assert companion.phase is Phase.FLYING, (companion.phase, companion.trouble, flight.drone.texts)
    return flight, companion


def advance(flight, seconds, is_enough=lambda: False):
    """Flies on for a time, or until it is enough."""
    end_us = flight.time_us + round(seconds * 1e6)
    flight.run(lambda _: is_enough() or flight.time_us >= end_us)


def hide(flight):
    """From now on nobody is to be seen."""
    flight.owner.cast.rows.params.numpy()["owner_hides_per_min"] = 60.0
    flight.owner.cast.rows.params.numpy()["owner_hide_s"] = 1e4


class LossyLink:
    """A link on which messages of some kinds are lost on the way to the companion."""

    def __init__(self, link, *lost):
        self._link, self._lost, self._reader = link, lost, FrameReader()
        self.send, self.close = link.send, link.close

    def receive(self):
        frames = [frame for data in self._link.receive() for frame in self._reader.feed(data)]
        return [frame.raw for frame in frames if frame.kind.name not in self._lost]


def lose(companion, *names):
    """From now on messages of these kinds do not reach the companion."""
    client = companion.vehicle._client
    client.link = LossyLink(client.link, *names)
