"""The conditions of the benchmark of following: what differs from the standard flight, and what must come of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mission.flight_settings import Pace  # no command waits for the options of another

_SILENT = {"phone_dropouts_per_min": 20.0, "phone_dropout_scale": 1e4}
_HIDDEN_3_S, _HIDDEN_8_S, _GONE = ({"owner_hides_per_min": 1.0, "owner_hide_s": hide_s} for hide_s in (3.0, 8.0, 1e4))
LEAST_KEPT, LEAST_STOOD, LEAST_RESUMED = 0.95, 0.95, 0.9
"""[1] of the flights of any condition, of those that it can be said of: that kept the owner, that stood in
time after the last sight, and that followed again in time."""


AIRFRAME = "x500"  # of a condition that names none


@dataclass(frozen=True, slots=True)
class Condition:
    """One row of the table."""

    name: str
    title: str
    pace: "Pace"
    numbers: Mapping[str, float] = field(default_factory=dict)
    """Of FollowMe, that differ from the standard."""
    least_in_band: float | None = None
    """[1] of the time; None: the owner cannot be followed all the time."""
    least_m: float | None = None
    """[m] never nearer to the owner's chest while they are hidden; None: not asked for."""
    most_accel: float | None = None
    """[m/s²] RMS, of the vehicle, level; None: not asked for."""
    most_yaw_rate: float | None = None
    """[deg/s] RMS; None: not asked for."""
    wind_m_s: float | None = None
    """None: by the seed."""
    airframe: str = AIRFRAME
    sensor_roughness: float = 0.0
    gnss_away_s: tuple[float, float] | None = None
    """From when to when of the following no satellite is received; None: never."""


CONDITIONS = (
    Condition("walk", "standard, walking", "walk", {}, 0.98, most_accel=0.8, most_yaw_rate=12.0),
    Condition("run", "standard, running", "run", {}, 0.95),
    Condition("silent", "the phone silent, running", "run", _SILENT, 0.95),
    Condition("late-100", "pictures 100 ms late", "run", {"image_lag_s": 0.1}, 0.95),
    Condition("late-200", "pictures 200 ms late", "run", {"image_lag_s": 0.2}, 0.92),
    Condition("late-300", "pictures 300 ms late", "run", {"image_lag_s": 0.3}, 0.85),
    Condition("jitter", "pictures 0 to 200 ms late, each anew", "run", {"image_jitter_s": 0.2}, 0.92),
    Condition("lost", "three pictures of ten lost", "run", {"image_loss": 0.3}, 0.95),
    Condition("frozen", "pictures frozen six times a minute", "run", {"image_freezes_per_min": 6.0}, 0.85),
    Condition("late-setpoints", "setpoints 80 ms late", "run", {"setpoint_lag_s": 0.08}, 0.95),
    Condition("gone-3", "owner not to be seen for 3 s", "walk", _HIDDEN_3_S, None, 1.5),
    Condition(
        "gone-3-silent", "owner not to be seen for 3 s, phone silent", "walk", {**_HIDDEN_3_S, **_SILENT}, None, 1.5
    ),
    Condition("gone-8", "owner not to be seen for 8 s", "walk", _HIDDEN_8_S, None, 1.5),
    Condition(
        "gone-8-silent", "owner not to be seen for 8 s, phone silent", "walk", {**_HIDDEN_8_S, **_SILENT}, None, 1.5
    ),
    Condition("gone", "owner gone for good", "walk", _GONE, None, 1.5),
    Condition("gone-silent", "owner gone for good, phone silent", "walk", {**_GONE, **_SILENT}, None, 1.5),
    Condition("gone-run", "owner gone for good, running", "run", _GONE, None, 1.5),
    Condition(
        "gone-3-run-silent",
        "owner not to be seen for 3 s, running, phone silent",
        "run",
        {**_HIDDEN_3_S, **_SILENT},
        None,
        1.5,
    ),
    Condition("crossed", "three others cross the way", "walk", {"bystanders": 3.0}, 0.95),
    Condition(
        "twins", "three others in the owner's clothes", "walk", {"bystanders": 3.0, "bystander_likeness": 1.0}, 0.95
    ),
    Condition("no-depth", "no depth", "walk", {"depth_max_m": 0.0}, 0.9),
    Condition("holes", "depth to 6 m, with holes", "walk", {"depth_max_m": 6.0, "depth_holes": 0.25}, 0.9),
    Condition("phone", "the phone four times as wrong", "walk", {"phone_error": 4.0}, 0.9),
    Condition("phone-late", "the phone's reports a second late", "walk", {"phone_lag_s": 1.0}, 0.9),
    Condition(
        "lens",
        "a lens that bends lines, wider and tilted, unknown to it",
        "walk",
        {"lens_scale": 1.04, "lens_tilt_deg": 3.0, "lens_distortion": 0.1},
        0.9,
    ),
    Condition("red", "red clothes", "walk", {"owner_hue": 0.0}, 0.9),
    Condition(
        "clothes", "any clothes, 0.85 of the size", "walk", {"owner_clothes_fraction": 1.0, "owner_size": 0.85}, 0.9
    ),
    Condition(
        "crouch",
        "crouches wherever they stop, which is often",
        "walk",
        {"owner_crouch_fraction": 1.0, "owner_stop_share": 0.35},
        0.9,
    ),
    Condition("dusk", "dusk", "walk", {"light": 0.12}, 0.9),
    Condition("blur", "pictures blurred by 33 ms", "walk", {"shutter_s": 0.033}, 0.9),
    Condition("wind", "wind of 10 m/s", "walk", {}, 0.9, wind_m_s=10.0),
    Condition("rough", "sensors as in the roughest real log", "walk", {}, 0.95, sensor_roughness=1.0),
    Condition("no-gnss", "no GNSS for 25 s", "walk", {}, 0.95, gnss_away_s=(10.0, 35.0)),
    Condition("f450", "airframe F450, smaller", "walk", {}, 0.95, airframe="f450"),
    Condition("f550", "airframe F550, of six motors", "walk", {}, 0.95, airframe="f550"),
    Condition("x500-fitted", "airframe of a real X500's log", "walk", {}, 0.95, airframe="x500-fitted"),
    Condition("f550-fitted", "airframe of a real hexacopter's log", "walk", {}, 0.95, airframe="f550-fitted"),
)
"""In the order of the table."""
BY_NAME = {condition.name: condition for condition in CONDITIONS}
