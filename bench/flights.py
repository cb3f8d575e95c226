"""How well does it fly? The standard trials (mission/trials.py), each against its target."""

import numpy as np

from bench.row import Row
from mission.flight import FlightConfig
from mission.summary import Summary
from mission.trials import fault_trial, hold_trial, mission_trial, square_trial, step_trial
from sim.world.world import WorldConfig

COMMAND = "python -m bench flights"
SEEDS = range(20)
WIND_M_S = 5.0
STRONG_WIND_M_S = 8.0
BAND_MIN, BAND_MAX = 0.92, 0.98  # of innovations inside their 95 % band


def measure() -> list[Row]:
    return [*_missions(), *_unknown_pads(), *_holds(), *_noise_free(), *_faults()]


def _row(name: str, value: float, unit: str, target: float | None, better: str = "lower") -> Row:
    return Row(name, value, unit, "higher" if better == "higher" else "lower", target, COMMAND)


def _missions() -> list[Row]:
    """The default mission, default noise, 5 m/s wind with turbulence and gusts, 20 seeds."""
    flights = [mission_trial(FlightConfig(seed=seed, wind_m_s=WIND_M_S)) for seed in SEEDS]
    shares = {name: [flight.innovations_in_band[name] for flight in flights] for name in flights[0].innovations_in_band}
    return [
        _row("missions completed of 20", sum(flight.is_success for flight in flights), "", 20, "higher"),
        _row("mission cross-track, 95 %, worst of 20", _worst(flights, "cross_track_p95_m"), "m", 1.5),
        _row("landing error in truth, worst of 20", _worst(flights, "landing_error_true_m"), "m", 1.5),
        _row("landing error by own estimate, worst of 20", _worst(flights, "landing_error_est_m"), "m", 0.4),
        _row("estimator, horizontal RMS per axis", _rms(flights, "pos_h_rms_m"), "m", 0.75),
        _row("estimator, vertical RMS", _rms(flights, "pos_v_rms_m"), "m", 0.8),
        _row("estimator, velocity RMS, worst axis", _rms(flights, "vel_rms_m_s"), "m/s", 0.12),
        _row("estimator, tilt RMS", _rms(flights, "tilt_rms_deg"), "deg", 0.5),
        _row("estimator, yaw RMS", _rms(flights, "yaw_rms_deg"), "deg", 2.0),
        *(
            row
            for name, share in shares.items()
            for row in (
                _row(f"innovations inside their 95 % band, {name}", float(np.mean(share)), "", BAND_MIN, "higher"),
                _row(f"innovations inside their 95 % band, {name}, at most", float(np.mean(share)), "", BAND_MAX),
            )
        ),
        _row("power-on to ready to arm, simulated, worst of 20", _worst(flights, "ready_s"), "s", 10.0),
    ]


def _unknown_pads() -> list[Row]:
    """The same missions, where the vehicle is not told that it boots at the origin: GNSS alone says where it is."""
    config = FlightConfig(wind_m_s=WIND_M_S, parameters={"EKF2_BOOT_STD": 100.0})
    flights = [mission_trial(config.model_copy(update={"seed": seed})) for seed in SEEDS]
    return [
        _row(
            "boot place unknown: missions completed of 20",
            sum(flight.is_success for flight in flights),
            "",
            20,
            "higher",
        ),
        _row("boot place unknown: horizontal RMS per axis", _rms(flights, "pos_h_rms_m"), "m", 0.75),
        _row("boot place unknown: vertical RMS", _rms(flights, "pos_v_rms_m"), "m", None),
        _row(
            "boot place unknown: landing error in truth, median of 20",
            _median(flights, "landing_error_true_m"),
            "m",
            None,
        ),
    ]


def _holds() -> list[Row]:
    calm = hold_trial(FlightConfig())
    windy = hold_trial(FlightConfig(wind_m_s=STRONG_WIND_M_S))
    return [
        _row("hold by own estimate, 95 %, no wind", calm.est_h_m, "m", 0.15),
        _row("hold by own estimate, 95 %, 8 m/s with gusts", windy.est_h_m, "m", 0.3),
    ]


def _noise_free() -> list[Row]:
    """With perfect sensors, in truth: what ArduPilot's simulator was measured at."""
    calm, windy = FlightConfig(noise=0.0), FlightConfig(noise=0.0, wind_m_s=STRONG_WIND_M_S)
    step = step_trial(calm)
    return [
        _row("noise 0: hold in truth, 95 %, no wind (ArduPilot 0.056)", hold_trial(calm).true_h_m, "m", 0.05),
        _row("noise 0: hold in truth, 95 %, 8 m/s (ArduPilot 0.088)", hold_trial(windy).true_h_m, "m", 0.08),
        _row("noise 0: 5 m step inside 0.3 m (ArduPilot 2.99)", step.inside_s, "s", 2.9),
        _row("noise 0: 5 m step, overshoot (ArduPilot 0.24)", step.overshoot_m, "m", 0.2),
        _row("noise 0: square cross-track, 95 %, no wind (ArduPilot 0.25)", square_trial(calm), "m", 0.2),
        _row("noise 0: square cross-track, 95 %, 8 m/s (ArduPilot 0.49)", square_trial(windy), "m", 0.4),
    ]


def _faults() -> list[Row]:
    """Sensors that fail in the mission; without position there is no telling trees apart, so GNSS fails over grass."""
    meadow = WorldConfig(trees_per_ha=0.0)
    upright = [
        fault_trial(FlightConfig(seed=seed, wind_m_s=WIND_M_S, world=meadow), "gnss", "off").is_disarmed_upright
        for seed in SEEDS
    ]
    finished = {
        sensor: [
            fault_trial(FlightConfig(seed=seed, wind_m_s=WIND_M_S), sensor, "stuck").is_mission_finished
            for seed in SEEDS
        ]
        for sensor in ("mag", "baro")
    }
    return [
        _row("GNSS off in flight: landed without a flip, of 20", sum(upright), "", 20, "higher"),
        _row("magnetometer stuck: mission finished, of 20", sum(finished["mag"]), "", 20, "higher"),
        _row("barometer stuck: mission finished, of 20", sum(finished["baro"]), "", 20, "higher"),
    ]


def _worst(flights: list[Summary], name: str) -> float:
    return float(max(getattr(flight, name) for flight in flights))


def _median(flights: list[Summary], name: str) -> float:
    return float(np.median([getattr(flight, name) for flight in flights]))


def _rms(flights: list[Summary], name: str) -> float:
    return float(np.sqrt(np.mean([getattr(flight, name) ** 2 for flight in flights])))
