"""Measurement noise found from a log: how large the innovations of each source are while the vehicle flies.

The errors of real sensors are correlated over seconds: a filter that took them for white noise of that size would
follow them. So the filter keeps the wide noise of `REAL_SENSORS`, and by itself takes more where a sensor is worse than
that. What is found judges the innovations: their bands, and the fraction inside. A few outliers change it little.
"""

from dataclasses import dataclass

import numpy as np

from mission.estimate.estimate_run import SOURCES, Replay
from mission.estimate.sensor_log import Rows

MIN_EVENTS = 30  # of a source in flight
SETTLE_US = 5_000_000  # after the start: the filter still learns
REST_US = 1_000_000  # around a moment at rest
OUTLIER = 3.0  # deviations
NORMAL_QUARTILE = 0.67449  # median of the absolute value of a normal number


@dataclass(frozen=True, slots=True)
class FoundNoise:
    """What the innovations of a source say."""

    std: float  # of the innovations, in the unit of the measurement
    scale: float  # to the standard deviation that the filter expects: wide noise makes it small


def found_noise(replay: Replay) -> dict[str, FoundNoise]:
    """The noise of each source that was judged often enough in flight."""
    found = {}
    for source, components in SOURCES.items():
        events = in_flight(replay, source)
        if source != "rest" and len(events):
            innov, innov_var = events["innov"][:, :components], events["innov_var"][:, :components]
            std, scale = _spread(innov), _spread(innov / np.sqrt(innov_var))
            if scale > 0.0:
                found[source] = FoundNoise(std, scale)
    return found


def in_flight(replay: Replay, source: str) -> Rows:
    """The events of a source while the vehicle moves; empty if they are too few to tell anything."""
    events = replay.events[source]
    start_us = replay.estimate["time_us"][0] if len(replay.output) else 0
    events = events[(events["time_us"] > start_us + SETTLE_US) & ~events["is_reset"]]
    rests = replay.events["rest"]["time_us"]
    if len(rests):
        after = np.searchsorted(rests, events["time_us"])
        since_us = events["time_us"] - rests[np.maximum(after - 1, 0)]
        until_us = rests[np.minimum(after, len(rests) - 1)] - events["time_us"]
        is_resting = ((after > 0) & (since_us < REST_US)) | ((after < len(rests)) & (until_us < REST_US))
        events = events[~is_resting]
    moving: Rows = events if len(events) >= MIN_EVENTS else events[:0]
    return moving


def median_spread(values: Rows) -> float:
    """The standard deviation of normal numbers with the same median of absolute values."""
    return float(np.median(np.abs(values))) / NORMAL_QUARTILE


def _spread(values: Rows) -> float:
    """Root mean square of values, outliers taken back to `OUTLIER` deviations by the median."""
    most = OUTLIER * median_spread(values)
    return float(np.sqrt(np.mean(np.clip(values, -most, most) ** 2)))
