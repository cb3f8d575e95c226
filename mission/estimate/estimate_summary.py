"""A replayed estimate judged: how each source fared, and how far it lies from other answers to the same flight."""

from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from autopilot.estimator.sensors import FUSED_SENSORS
from autopilot.ports import HEIGHT_VALID, POSITION_VALID, VELOCITY_VALID, YAW_ALIGNED
from common.geodesy import GeoPoint
from mission.estimate.estimate_difference import Difference, difference
from mission.estimate.estimate_noise import FoundNoise, in_flight, median_spread
from mission.estimate.estimate_run import SOURCES, Replay
from mission.estimate.sensor_log import SensorLog

BAND_SIGMA = 1.959964  # 95 % of a normal distribution lie within


@dataclass(frozen=True, slots=True)
class SourceSummary:
    """One source of measurements."""

    judged: int  # samples whose innovation was computed
    fused: int
    rejected: int  # by the gate
    resets: int  # times the state was set to a sample, the first included
    noise_found: float  # standard deviation of its innovations in flight, NaN where that cannot be told
    normalised_by_filter: float  # the same, over what the filter expects: its noise is wide, so below 1
    normalised: float  # spread, by the median, over the noise found (own logs: what the filter expects); 1 if normal
    in_band: float  # fraction of normalised innovations within 1.96 sigma, NaN where none was judged


@dataclass(frozen=True, slots=True)
class EstimateSummary:
    """The figures of one replay."""

    log: str
    duration_s: float
    samples: dict[str, int]  # per sensor, as given to the estimator
    origin: GeoPoint | None
    sources: dict[str, SourceSummary]
    valid: dict[str, float]  # fraction of the time in which a part of the estimate was valid
    final_gyro_bias_frd_rad_s: tuple[float, ...]
    final_accel_bias_frd_m_s2: tuple[float, ...]
    final_body_field_frd_gauss: tuple[float, ...]
    reset_count: int
    fault_count: int
    differences: dict[str, Difference]
    parameters: dict[str, float]
    notes: list[str]

    def as_json(self) -> dict[str, Any]:
        """JSON values; NaN as null."""
        plain: dict[str, Any] = _without_nan(asdict(self))
        return plain


def summarise_replay(
    log: SensorLog, replay: Replay, noise: dict[str, FoundNoise], parameters: dict[str, float]
) -> EstimateSummary:
    """Judges a replay that has at least one row of output.

    Args:
        log: the samples.
        replay: what the estimator answered.
        noise: found from the log, by source; empty: innovations are judged by the filter's own.
        parameters: with which it ran.
    """
    estimate = replay.estimate
    last = replay.output[-1]
    flags = {"position": POSITION_VALID, "velocity": VELOCITY_VALID, "height": HEIGHT_VALID, "yaw": YAW_ALIGNED}
    return EstimateSummary(
        log=log.recording.path.name,
        duration_s=log.duration_s,
        samples={"imu": len(log.imu), **{sensor.name: len(log.samples_of(sensor)) for sensor in FUSED_SENSORS}},
        origin=log.origin,
        sources={name: _source(replay, name, components, noise.get(name)) for name, components in SOURCES.items()},
        valid={name: float(np.mean((estimate["flags"] & flag) != 0)) for name, flag in flags.items()},
        final_gyro_bias_frd_rad_s=tuple(last["estimate"]["gyro_bias_frd"].tolist()),
        final_accel_bias_frd_m_s2=tuple(last["estimate"]["accel_bias_frd"].tolist()),
        final_body_field_frd_gauss=tuple(last["body_field_frd"].tolist()),
        reset_count=sum(int(np.count_nonzero(events["is_reset"])) for events in replay.events.values()),
        fault_count=replay.fault_count,
        differences={track.name: difference(estimate, track, log.origin) for track in log.recording.tracks},
        parameters=parameters,
        notes=log.recording.notes,
    )


def _source(replay: Replay, name: str, components: int, noise: FoundNoise | None) -> SourceSummary:
    """Counts of all samples; the innovations judged are those in flight if the noise was found there."""
    events = replay.events[name]
    fused, resets = int(np.count_nonzero(events["is_fused"])), int(np.count_nonzero(events["is_reset"]))
    shown = events if noise is None else in_flight(replay, name)
    scale = 1.0 if noise is None else noise.scale
    normalised = shown["innov"][:, :components] / np.sqrt(shown["innov_var"][:, :components]) / scale
    return SourceSummary(
        judged=len(events),
        fused=fused,
        rejected=len(events) - fused - resets,
        resets=resets,
        noise_found=nan if noise is None else noise.std,
        normalised_by_filter=nan if noise is None else noise.scale,
        normalised=median_spread(normalised) if len(shown) else nan,
        in_band=float(np.mean(np.abs(normalised) <= BAND_SIGMA)) if len(shown) else nan,
    )


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value
