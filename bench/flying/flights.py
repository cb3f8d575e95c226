"""How well does it fly? The standard trials (mission/flight_benchmarks.py), each against its target."""

import numpy as np

from bench.row import Row
from mission.flight import FlightConfig
from mission.flight_benchmarks import fault_trial, hold_trial, mission_trial, square_trial, step_trial
from mission.log.flight_summary import Summary

COMMAND = "python -m bench flights"
SEEDS = range(20)
FEW_SEEDS = range(5)
WIND_M_S = 5.0
STRONG_WIND_M_S = 8.0
BAND_MIN, BAND_MAX = 0.92, 0.98  # of innovations inside their 95 % band


def measure() -> list[Row]:
    return [*_missions(), *_known_pads(), *_holds(), *_noise_free(), *_faults()]


def _row(name: str, value: float, unit: str, target: float | None, better: str = "lower") -> Row:
    return Row(name, value, unit, "higher" if better == "higher" else "lower", target, COMMAND)


def _missions() -> list[Row]:
    """The default mission, default noise, 5 m/s wind with turbulence and gusts, 20 seeds."""
    flights = [mission_trial(FlightConfig(seed=seed, wind_m_s=WIND_M_S)) for seed in SEEDS]
    fractions = {
        name: [flight.innovations_in_band[name] for flight in flights] for name in flights[0].innovations_in_band
    }
    return [
        _row("missions completed of 20", sum(flight.is_success for flight in flights), "", 20, "higher"),
        _row("mission cross-track, 95 %, worst of 20", _worst(flights, "cross_track_p95_m"), "m", 1.5),
        _row("landing error in truth, worst of 20", _worst(flights, "landing_error_true_m"), "m", 1.5),
        _row("landing error by own estimate, worst of 20", _worst(flights, "landing_error_est_m"), "m", 0.4),
        *_estimator(flights),
        *(
            row
            for name, fraction in fractions.items()
            for row in (
                _row(
                    f"innovations inside their 95 % band, {name}, mean",
                    float(np.mean(fraction)),
                    "",
                    BAND_MIN,
                    "higher",
                ),
                _row(f"innovations inside their 95 % band, {name}, least of 20", min(fraction), "", BAND_MIN, "higher"),
                _row(f"innovations inside their 95 % band, {name}, most of 20", max(fraction), "", BAND_MAX),
            )
        ),
        _row("power-on to ready to arm, simulated, worst of 20", _worst(flights, "ready_s"), "s", 10.0),
    ]


def _estimator(flights: list[Summary]) -> list[Row]:
    """RMS errors over all flights together, and of the worst flight."""
    figures = [
        ("horizontal RMS per axis", "pos_h_rms_m", "m", 0.75),
        ("vertical RMS", "pos_v_rms_m", "m", 0.8),
        ("velocity RMS, worst axis", "vel_rms_m_s", "m/s", 0.12),
        ("tilt RMS", "tilt_rms_deg", "deg", 0.5),
        ("yaw RMS", "yaw_rms_deg", "deg", 2.0),
    ]
    return [
        row
        for name, field, unit, target in figures
        for row in (
            _row(f"estimator, {name}", _rms(flights, field), unit, target),
            _row(f"estimator, {name}, worst of 20", _worst(flights, field), unit, None),
        )
    ]


def _known_pads() -> list[Row]:
    """The same missions, where the vehicle is told that it boots at the origin: a surveyed pad."""
    config = FlightConfig(wind_m_s=WIND_M_S, parameters={"EKF2_BOOT_STD": 0.1})
    flights = [mission_trial(config.model_copy(update={"seed": seed})) for seed in SEEDS]
    return [
        _row("surveyed pad: missions completed of 20", sum(flight.is_success for flight in flights), "", 20, "higher"),
        _row("surveyed pad: estimator, horizontal RMS per axis", _rms(flights, "pos_h_rms_m"), "m", None),
        _row("surveyed pad: landing error in truth, worst of 20", _worst(flights, "landing_error_true_m"), "m", None),
    ]


def _holds() -> list[Row]:
    calm = [hold_trial(FlightConfig(seed=seed)) for seed in FEW_SEEDS]
    windy = [hold_trial(FlightConfig(seed=seed, wind_m_s=STRONG_WIND_M_S)) for seed in FEW_SEEDS]
    return [
        _row("hold by own estimate, 95 %, no wind, worst of 5", max(hold.est_h_m for hold in calm), "m", 0.15),
        _row("hold by own estimate, vertical, 95 %, no wind, worst of 5", max(h.est_v_m for h in calm), "m", 0.15),
        _row("hold by own estimate, 95 %, 8 m/s with gusts, worst of 5", max(hold.est_h_m for hold in windy), "m", 0.3),
        _row("hold by own estimate, vertical, 95 %, 8 m/s, worst of 5", max(h.est_v_m for h in windy), "m", 0.3),
    ]


def _noise_free() -> list[Row]:
    """With perfect sensors, in truth: what ArduPilot's simulator was measured at. Seeds differ in turbulence only."""
    calm = FlightConfig(noise=0.0)
    windy = [FlightConfig(noise=0.0, wind_m_s=STRONG_WIND_M_S, seed=seed) for seed in FEW_SEEDS]
    step = step_trial(calm)
    hold = hold_trial(calm)
    holds = [hold_trial(config) for config in windy]
    squares = [square_trial(config) for config in windy]
    return [
        _row("noise 0: hold in truth, 95 %, no wind (ArduPilot 0.056)", hold.true_h_m, "m", 0.05),
        _row("noise 0: hold in truth, 95 %, 8 m/s, worst of 5 (0.088)", max(h.true_h_m for h in holds), "m", 0.08),
        _row("noise 0: 5 m step inside 0.3 m (2.99)", step.inside_s, "s", 2.9),
        _row("noise 0: 5 m step, overshoot (0.24)", step.overshoot_m, "m", 0.2),
        _row("noise 0: square cross-track, 95 %, no wind (0.25)", square_trial(calm), "m", 0.2),
        _row("noise 0: square cross-track, 95 %, 8 m/s, worst of 5 (0.49)", max(squares), "m", 0.4),
    ]


def _faults() -> list[Row]:
    """Sensors that fail as the third item of the default mission becomes current."""
    windy = [FlightConfig(seed=seed, wind_m_s=WIND_M_S) for seed in SEEDS]
    upright = [fault_trial(config, "gnss", "off").is_disarmed_upright for config in windy]
    mag = [fault_trial(config, "mag", "stuck").is_mission_finished for config in windy]
    baro = [fault_trial(config, "baro", "stuck").is_mission_finished for config in windy]
    return [
        _row("GNSS off in flight: landed without a flip, of 20", sum(upright), "", 20, "higher"),
        _row("magnetometer stuck: mission finished, of 20", sum(mag), "", 20, "higher"),
        _row("barometer stuck: mission finished, of 20", sum(baro), "", 20, "higher"),
    ]


def _worst(flights: list[Summary], name: str) -> float:
    return float(max(getattr(flight, name) for flight in flights))


def _rms(flights: list[Summary], name: str) -> float:
    return float(np.sqrt(np.mean([getattr(flight, name) ** 2 for flight in flights])))
