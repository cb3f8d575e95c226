"""A flight, read and judged: everything that its page shows."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from common.geodesy import GeoPoint
from mission.review.check_margins import Check, checks_of, result_fault, result_of
from mission.review.curves import Section
from mission.review.logged_flight import LoggedFlight, read_flight
from mission.review.panels import actuators, estimator, motion, sensors
from mission.review.summary import changed_parameters, distance_m, summary
from mission.review.timeline import Timeline, timeline
from mission.review.track import Track, track
from mission.review.verdicts import Verdict, verdicts
from mission.review.vibration import Spectrum, spectra, vibration

AIDS = "gnss_pos gnss_vel gnss_hgt baro_hgt mag mag_heading heading rng_hgt ev_pos ev_vel optical_flow airspeed".split()
TOPICS = (
    "actuator_controls_0 actuator_motors actuator_outputs actuator_servos battery_status control_allocator_status "
    "distance_sensor ekf2_innovations esc_status estimator_innovation_test_ratios estimator_innovation_variances "
    "estimator_innovations estimator_sensor_bias estimator_status home_position position_setpoint_triplet sensor_accel "
    "sensor_combined sensor_gps sensor_gyro sensor_mag trajectory_setpoint vehicle_acceleration vehicle_air_data "
    "vehicle_angular_velocity vehicle_angular_velocity_groundtruth vehicle_attitude vehicle_attitude_groundtruth "
    "vehicle_attitude_setpoint vehicle_global_position vehicle_gps_position vehicle_imu_status vehicle_land_detected "
    "vehicle_local_position vehicle_local_position_groundtruth vehicle_local_position_setpoint vehicle_magnetometer "
    "vehicle_rates_setpoint vehicle_status vehicle_thrust_setpoint vehicle_torque_setpoint"
).split() + [f"estimator_aid_src_{aid}" for aid in AIDS]
PLOTTED = (
    motion.position,
    sensors.heights,
    motion.velocity,
    motion.attitude,
    motion.rates,
    estimator.estimator,
    actuators.actuators,
    vibration,
    sensors.power,
    sensors.gnss,
    sensors.magnetometer,
)


@dataclass(frozen=True, eq=False, slots=True)
class FlightReview:
    """One flight."""

    flight: LoggedFlight
    timeline: Timeline
    track: Track | None
    sections: tuple[Section, ...]
    spectra: tuple[Spectrum, ...]
    spectra_missing: tuple[str, ...]
    verdicts: tuple[Verdict, ...]
    summary: tuple[tuple[str, str], ...]
    changed_parameters: tuple[tuple[str, float, float], ...]
    checks: tuple[Check, ...]
    result: str
    result_fault: str
    """What is wrong with the file of its result, in a sentence; "": nothing."""

    @property
    def distance_m(self) -> float:
        return 0.0 if self.track is None else distance_m(self.track)


def review_flight(paths: tuple[Path, ...], name: str, folder: Path | None, origin: GeoPoint | None) -> FlightReview:
    """Reads and judges a flight.

    Args:
        paths: the parts of its log.
        name: what it is called.
        folder: of its run; None: a log by itself.
        origin: of the map, that of the flight it is compared with; None: its own.

    Raises:
        ReviewError: the log cannot be read.
    """
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # NumPy's, of columns that hold nothing but NaN
        return _judged(read_flight(paths, name, TOPICS), folder, origin)


def _judged(flight: LoggedFlight, folder: Path | None, origin: GeoPoint | None) -> FlightReview:
    when = timeline(flight)
    where = track(flight, origin)
    found, missing = spectra(flight)
    return FlightReview(
        flight=flight,
        timeline=when,
        track=where,
        sections=tuple(plotted(flight) for plotted in PLOTTED),
        spectra=tuple(found),
        spectra_missing=tuple(missing),
        verdicts=tuple(verdicts(flight, when)),
        summary=tuple(summary(flight, when, where)),
        changed_parameters=tuple(changed_parameters(flight)),
        checks=() if folder is None else checks_of(folder),
        result="" if folder is None else result_of(folder),
        result_fault="" if folder is None else result_fault(folder),
    )
