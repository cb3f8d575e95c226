"""The pilot's sticks: who moves them, where they are, and whether they are still heard.

In: joystick positions (MANUAL_CONTROL) and overridden radio channels (RC_CHANNELS_OVERRIDE) as clients send them. Out:
one `StickInput`, which the stick modes fly and telemetry shows. Nothing is computed until a message comes: whether the
sticks are heard is one comparison with the time of this frame.

With `has_radio` a simulated radio lies beside the vehicle, as in ArduPilot's SITL: sticks in the middle, the throttle
where it rests. It has what no client overrides, and everything again once the overrides are released or time out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from common.params import Parameter, ParameterTable

CHANNELS = 18  # of RC_CHANNELS
CALIBRATED = 8  # channels with parameters of their own
UNUSED = 0xFFFF  # in RC_CHANNELS: no such channel
_RELEASED = 0  # no value: nobody overrides the channel
_RADIO_US = (1500, 1500, 1000, 1500, 1800, 1000, 1000, 1800) + (0,) * 10  # what nobody touches (ArduPilot's SITL)
_RADIO_MIDDLE_US, _RADIO_LOW_US = 1500, 1000
_PULSES_US = (800, 2200)  # a pulse outside is none
_MOVED_S = 0.1  # low-pass of a stick's speed (PX4: MovingDiff)


class InMode(IntEnum):
    """COM_RC_IN_MODE: whose sticks count."""

    RADIO = 0
    JOYSTICK = 1
    EITHER = 2  # another takes over when the one in control falls silent
    FIRST = 3  # the kind that came first, until power-off
    NONE = 4


class Source(IntEnum):
    """Kinds of senders."""

    RADIO = 0
    JOYSTICK = 1


@dataclass(slots=True)
class StickInput:
    """Where the sticks are, each -1..1, and what a radio receiver would put out."""

    roll: float = 0.0  # right is positive
    pitch: float = 0.0  # forward is positive
    yaw: float = 0.0  # clockwise is positive
    throttle: float = 0.0  # up is positive, 0 is the middle
    buttons: int = 0
    channels: list[int] = field(default_factory=lambda: [_RELEASED] * CHANNELS)  # [us], 0: no value
    count: int = 0  # of messages taken; grows with each
    heard_until_us: int = 0  # the sticks are lost after that; 0: never heard
    speed: float = 0.0  # [1/s] of the stick that moves fastest, low-passed
    is_ardupilot: bool = False  # they are read as ArduPilot reads them, where the two differ
    steer_hold: bool = False  # the sticks are followed in Hold as they are in Position (ArduPilot's LOITER)
    is_untouched: bool = False  # a radio is heard, and nobody is at its sticks

    def has_pilot(self, now_us: int) -> bool:
        """Whether somebody steers: a mode that flies by itself does so beside a radio that nobody touches."""
        return now_us <= self.heard_until_us and not self.is_untouched


class Sticks:
    """The sticks of one vehicle.

    Args:
        params: COM_RC_*, RC_*.
    """

    __slots__ = (
        "_calibration", "_first", "_heard_us", "_in_mode", "_loss_us", "_map", "_override_us", "_overrides",
        "_params", "_radio", "_sender", "_speeds", "has_radio", "input", "is_cut", "is_forward_low",
        "rests_in_middle", "takes_every_source", "takes_over",
    )  # fmt: skip

    def __init__(self, params: ParameterTable) -> None:
        self.input = StickInput()
        self.is_cut = False  # a failure: nothing is heard
        self.is_forward_low = False  # a pitch stick pushed forward is a short pulse (ArduPilot), not a long one (PX4)
        self.takes_every_source = False  # whatever COM_RC_IN_MODE says: ArduPilot has no such setting
        self.takes_over = True  # moving them may leave auto modes, as COM_RC_OVERRIDE says; not in ArduPilot
        self.rests_in_middle = False  # the simulated radio's throttle, which is low otherwise
        self.has_radio = False  # a simulated one, whose sticks nobody touches
        self._overrides = [_RELEASED] * CHANNELS  # [us] by the sender in control
        self._params = params
        self._sender: tuple[Source, int, int] | None = None  # in control: kind, system and component id
        self._first: Source | None = None  # kind that came first since power-on
        self._heard_us = 0
        self._speeds = [0.0, 0.0, 0.0, 0.0]  # [1/s]
        self._load()
        params.on_change(self._on_parameter)

    def follow_ardupilot(self, *, rests_in_middle: bool = False) -> None:
        """From now on the sticks are read as ArduPilot reads them.

        Args:
            rests_in_middle: the throttle nobody touches is in the middle, where it stands still, and not low.
        """
        self.rests_in_middle = rests_in_middle
        self._load()
        self.is_forward_low = True
        self.takes_every_source = True
        self.takes_over = False
        self.input.steer_hold = True
        self.input.is_ardupilot = True
        self.has_radio = True
        self._hand_back()

    def frame(self, now_us: int) -> None:
        """The simulated radio's part, where there is one: it is heard unless cut, and takes over from lost senders."""
        if not self.has_radio or self.is_cut:
            return
        if self._sender is not None and now_us > self.input.heard_until_us:
            self._hand_back()
        if self._sender is None:
            self.input.heard_until_us = now_us + self._loss_us

    def _hand_back(self) -> None:
        """Gives the sticks to the simulated radio."""
        now = self.input
        self._sender = None
        self._overrides = [_RELEASED] * CHANNELS
        now.buttons = 0
        now.speed = 0.0
        now.count += 1
        now.is_untouched = True
        self._read_channels()

    def _read_channels(self) -> None:
        """Every channel as overridden, or else the radio's; and the sticks that they mean."""
        now = self.input
        radio = self._radio if self.has_radio else (_RELEASED,) * CHANNELS
        now.channels[:] = [pulse or radio_us for pulse, radio_us in zip(self._overrides, radio, strict=True)]
        now.roll, pitch, now.yaw, now.throttle = (self._deflection(stick) for stick in self._map)
        now.pitch = -pitch if self.is_forward_low else pitch

    # ---- what others ask ----

    def is_heard(self, now_us: int) -> bool:
        """Whether there are sticks."""
        return now_us <= self.input.heard_until_us

    def is_lost(self, now_us: int) -> bool:
        """Whether there were sticks, and are none now."""
        return 0 < self.input.heard_until_us < now_us

    def forget(self, now_us: int) -> None:
        """Sticks that are lost now count as never heard, until they are heard again."""
        if self.is_lost(now_us):
            self.input.heard_until_us = 0

    # ---- what comes in ----

    def joystick_moved(
        self,
        sender: tuple[int, int],
        now_us: int,
        axes: tuple[float | None, float | None, float | None, float | None],
        buttons: int,
    ) -> str:
        """Takes a joystick's position; returns why it does not count, empty if it does.

        Args:
            sender: system and component id.
            now_us: time.
            axes: roll, pitch, yaw, throttle, each -1..1; None leaves one as it is.
            buttons: bits.
        """
        # ArduPilot takes a joystick for overridden channels: it may be silent for as long
        silence_us = self._override_us if self.has_radio else self._loss_us
        refusal = self._take_control(Source.JOYSTICK, sender, now_us, silence_us)
        if refusal is not None:
            return refusal
        now = self.input
        now.is_untouched = False
        old = (now.roll, now.pitch, now.yaw, now.throttle)
        roll, pitch, yaw, throttle = (was if axis is None else axis for was, axis in zip(old, axes, strict=True))
        now.buttons = buttons
        self._move(now_us, roll, pitch, yaw, throttle)
        for stick, value in zip(self._map, (roll, pitch, yaw, throttle), strict=True):
            if stick:
                is_turned = stick == self._map[1] and self.is_forward_low
                self._overrides[stick - 1] = self._pulse_us(stick, -value if is_turned else value)
                now.channels[stick - 1] = self._overrides[stick - 1]
        return ""

    def channels_overridden(self, sender: tuple[int, int], now_us: int, pulses_us: Sequence[int | None]) -> str:
        """Takes overridden radio channels; returns why they do not count, empty if they do.

        Args:
            sender: system and component id.
            now_us: time.
            pulses_us: of each channel [us]; 0 releases one, None leaves it as it is.
        """
        now = self.input
        was_heard_us = now.heard_until_us
        refusal = self._take_control(Source.RADIO, sender, now_us, self._override_us)
        if refusal is not None:
            return refusal
        overrides = self._overrides
        for i, pulse_us in enumerate(pulses_us[:CHANNELS]):
            if pulse_us is not None:
                overrides[i] = pulse_us if _PULSES_US[0] <= pulse_us <= _PULSES_US[1] else _RELEASED
        if self.has_radio and not any(overrides):
            self._hand_back()
            now.heard_until_us = now_us + self._loss_us  # as of the radio, and not of who had overridden it
            return ""
        old = (now.roll, now.pitch, now.yaw, now.throttle)
        self._read_channels()
        now.is_untouched = not any(stick and overrides[stick - 1] for stick in self._map)  # switches at most
        if now.is_untouched and not self.has_radio:  # nobody flies, or no more
            now.heard_until_us = min(was_heard_us, now_us - 1)
            now.speed = 0.0
            now.count += 1
            return ""
        now.buttons = 0
        new = (now.roll, now.pitch, now.yaw, now.throttle)
        now.roll, now.pitch, now.yaw, now.throttle = old
        self._move(now_us, *new)
        return ""

    def _take_control(self, source: Source, sender: tuple[int, int], now_us: int, silence_us: int) -> str | None:
        """Gives the sender control for a while; returns None, or why not (empty if another is in control)."""
        mode = self._in_mode
        if self.is_cut:
            return ""
        is_wrong = mode is InMode.NONE or mode == 1 - source
        if mode is InMode.FIRST:
            is_wrong = self._first not in (None, source)
        if is_wrong and not self.takes_every_source:
            return f"COM_RC_IN_MODE {int(mode)} does not take a {source.name.lower()}"
        who = (source, *sender)
        if who != self._sender:
            if self.is_heard(now_us) and self._sender is not None:
                return ""
            self._sender = who
            self._overrides = [_RELEASED] * CHANNELS
            self._read_channels()
        if self._first is None:
            self._first = source
        if not self.is_heard(now_us):
            self._heard_us = 0  # after a silence the sticks have not moved but been found somewhere else
        self.input.heard_until_us = now_us + silence_us
        return None

    def _move(self, now_us: int, roll: float, pitch: float, yaw: float, throttle: float) -> None:
        """Sets the sticks, and how fast they move."""
        now = self.input
        dt_s = (now_us - self._heard_us) * 1e-6
        if self._heard_us == 0:
            self._speeds = [0.0, 0.0, 0.0, 0.0]
            now.speed = 0.0
        elif dt_s > 0.0:
            moved_by = (roll - now.roll, pitch - now.pitch, yaw - now.yaw, throttle - now.throttle)
            fraction = 1.0 / (dt_s + _MOVED_S)
            self._speeds = [
                speed * _MOVED_S * fraction + moved * fraction
                for speed, moved in zip(self._speeds, moved_by, strict=True)
            ]
            now.speed = max(map(abs, self._speeds))
        self._heard_us = now_us
        now.roll, now.pitch, now.yaw, now.throttle = roll, pitch, yaw, throttle
        now.count += 1

    # ---- radio channels ----

    def switch_position(self, channel: int, positions: int) -> int:
        """Which of some positions (1..) a switch on a channel is in; 0: not known."""
        if not 0 < channel <= CHANNELS or self.input.channels[channel - 1] == _RELEASED:
            return 0
        fraction = 0.5 * (self._deflection(channel) + 1.0)
        return min(int(fraction * positions), positions - 1) + 1

    def _deflection(self, channel: int) -> float:
        """-1..1 of a channel by its calibration; 0 without a value."""
        if channel == 0 or self.input.channels[channel - 1] == _RELEASED:
            return 0.0
        low, trim, high, sign, dead = self._calibration[channel - 1]
        away = self.input.channels[channel - 1] - trim
        if abs(away) <= dead:
            return 0.0
        span = high - trim - dead if away > 0.0 else trim - low - dead
        value = (away - dead if away > 0.0 else away + dead) / max(span, 1.0)
        return sign * min(max(value, -1.0), 1.0)

    def _pulse_us(self, channel: int, value: float) -> int:
        """The pulse that `_deflection` reads as this value."""
        low, trim, high, sign, dead = self._calibration[channel - 1]
        value *= sign
        if value == 0.0:
            return round(trim)
        if value > 0.0:
            return round(trim + dead + value * (high - trim - dead))
        return round(trim - dead + value * (trim - low - dead))

    def _load(self) -> None:
        params = self._params
        self._in_mode = InMode(int(params["COM_RC_IN_MODE"]))
        self._loss_us = round(float(params["COM_RC_LOSS_T"]) * 1e6)
        self._override_us = round(float(params["RC_OVERRIDE_TIME"]) * 1e6)
        names = ("RC_MAP_ROLL", "RC_MAP_PITCH", "RC_MAP_YAW", "RC_MAP_THROTTLE")
        self._map = tuple(int(params[name]) for name in names)
        self._radio = list(_RADIO_US)
        rest_us = _RADIO_MIDDLE_US if self.rests_in_middle else _RADIO_LOW_US
        for stick, pulse_us in zip(self._map, (_RADIO_MIDDLE_US,) * 3 + (rest_us,), strict=True):
            if stick:
                self._radio[stick - 1] = pulse_us
        self._calibration = [
            tuple(float(params[f"RC{i}_{name}"]) for name in ("MIN", "TRIM", "MAX", "REV", "DZ"))
            for i in range(1, CALIBRATED + 1)
        ] + [(1000.0, 1500.0, 2000.0, 1.0, 0.0)] * (CHANNELS - CALIBRATED)

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name.startswith(("COM_RC_", "RC")):
            self._load()


def without_centre(value: float, dead: float) -> float:
    """The value with a dead zone around 0, from -1 to 1 nevertheless."""
    if abs(value) <= dead:
        return 0.0
    return (value - dead if value > 0.0 else value + dead) / (1.0 - dead)


def curved(value: float, expo: float, super_expo: float = 0.0) -> float:
    """The value [-1..1] on a cubic curve (PX4: expo), steeper at its ends with `super_expo` [0..1) (PX4: superexpo)."""
    cubic = (1.0 - expo) * value + expo * value**3
    return cubic * (1.0 - super_expo) / (1.0 - abs(value) * super_expo)
