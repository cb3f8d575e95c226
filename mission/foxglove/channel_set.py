"""The channels of one sink: opened when there is something to say, at their rates, logged by simulated time."""

import json
from math import isfinite
from typing import Any

from foxglove import Channel, Context, channels

from mission.foxglove.channels import ChannelSpec, Json, NumbersSpec

DIGITS = 6  # of the numbers that are plotted


class ChannelSet:
    """Channels of one context.

    Args:
        context: whose sinks get the messages.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self._open: dict[str, Any] = {}
        self._due_us: dict[str, int] = {}

    def open(self, spec: ChannelSpec) -> Any:
        """The channel, made when it is first asked for."""
        channel = self._open.get(spec.topic)
        if channel is None:
            channel = self._open[spec.topic] = self._make(spec)
        return channel

    def is_due(self, spec: ChannelSpec, time_us: int) -> bool:
        """Whether a message of this moment is wanted: by the channel's rate, and because somebody hears it.

        It counts as sent then.
        """
        due_us = self._due_us.get(spec.topic, 0)
        if time_us < due_us or not self.open(spec).has_sinks():
            return False
        if spec.period_us == 0:
            self._due_us[spec.topic] = 1 << 62
        else:
            self._due_us[spec.topic] = max(due_us + spec.period_us, time_us - spec.period_us + 1)
        return True

    def repeat(self, topic: str) -> None:
        """Somebody new hears the channel: what is said once is said again."""
        self._due_us.pop(topic, None)

    def log(self, spec: ChannelSpec, message: Any, time_us: int) -> None:
        """One message, at its simulated time."""
        self.open(spec).log(message, log_time=time_us * 1000)

    def log_numbers(self, spec: NumbersSpec, values: Json, time_us: int) -> None:
        """One message of numbers; what is not finite is left out, because JSON has no word for it."""
        found = _finite(values)
        if found:
            self.open(spec).log(json.dumps(found, allow_nan=False, separators=(",", ":")), log_time=time_us * 1000)

    def _make(self, spec: ChannelSpec) -> Any:
        if isinstance(spec, NumbersSpec):
            return Channel(spec.topic, schema=spec.json_schema(), context=self._context)
        typed: Any = getattr(channels, f"{spec.schema.removeprefix('foxglove.')}Channel")
        return typed(spec.topic, context=self._context)


def _finite(values: Json) -> Json:
    found: Json = {}
    for name, value in values.items():
        if isinstance(value, dict):
            inner = _finite(value)
            if inner:
                found[name] = inner
        elif isinstance(value, list):
            found[name] = [round(float(each), DIGITS) for each in value]
        elif isinstance(value, str | bool):
            found[name] = value
        elif isfinite(value):
            found[name] = round(float(value), DIGITS)
    return found
