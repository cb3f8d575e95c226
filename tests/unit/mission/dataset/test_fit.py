"""`honeyguide dataset fit`: a flown vehicle's numbers from its log; what cannot be fitted is refused in a sentence."""

import random
from math import atan2, cos, sin

import numpy as np
import pytest
from typer.testing import CliRunner

from common.airframe import AIRFRAME_FOLDER, load_airframe
from common.logs.ulog import UlogWriter
from mission.cli import app
from mission.dataset.fit.ulog_topics import TOPICS
from mission.flight import Flight, FlightConfig
from sim.world.world_config import WorldConfig

CHANGES = {
    "mass_kg": 1.2,
    "inertia_xx_kg_m2": 1.3,
    "inertia_yy_kg_m2": 1.4,
    "thrust_n_s2": 0.9,
    "drag_n_s2_m": 1.5,
    "spin_up_time_s": 1.6,
    "spin_down_time_s": 1.6,
}
MASS_KG = 1.5 * CHANGES["mass_kg"]
WITHIN = {  # commands are logged at 50 Hz of 250, which makes inertias a tenth too small
    "thrust_n_s2": 0.03, "drag_n_s2_m": 0.2, "spin_up_time_s": 0.15, "inertia_xx_kg_m2": 0.17, "inertia_yy_kg_m2": 0.17
}  # fmt: skip
PLAIN = WorldConfig(hill_height_m=0.0, treeless_radius_m=400.0)
STILL = {
    "vehicle_local_position": {"z": -20.0, "vx": 0.0, "vy": 0.0, "vz": 0.0},
    "vehicle_attitude": {"q": (1.0, 0.0, 0.0, 0.0)},
    "vehicle_angular_velocity": {"xyz": (0.0, 0.0, 0.0)},
    "actuator_motors": {"control": (0.6, 0.6, 0.6, 0.6)},
}


async def lively(drone):
    """Forty velocities, none for long."""
    rng = random.Random(3)
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(20.0)
    drone.offboard_velocity(0.0, 0.0, 0.0, 0.0)
    await drone.start_offboard()
    yaw = 0.0
    for _ in range(40):
        north, east, down = drone.pos_ned
        yaw += rng.uniform(-1.5, 1.5)
        course, speed = atan2(-east, -north) + rng.uniform(-1.2, 1.2), rng.uniform(1.0, 10.0)
        climb = rng.uniform(-2.0, 2.0) + (2.0 if down < -45.0 else -1.5 if down > -15.0 else 0.0)
        drone.offboard_velocity(speed * cos(course), speed * sin(course), climb, yaw)
        await drone.sleep(1.2)
    await drone.hold()
    await drone.land()


def values(airframe):
    return {name: getattr(section, name) for section in (airframe.body, airframe.rotor_model) for name in WITHIN
            if hasattr(section, name)}  # fmt: skip


@pytest.fixture(scope="module")
def flight_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flight")
    lines = (AIRFRAME_FOLDER / "x500.toml").read_text().splitlines()
    for i, line in enumerate(lines):
        name = line.split(" = ")[0]
        if name in CHANGES:
            value = line.split("value = ")[1].split(",")[0]
            lines[i] = line.replace(f"value = {value}", f"value = {float(value) * CHANGES[name]}")
    (folder / "true.toml").write_text("\n".join(lines))
    flight = Flight(FlightConfig(airframe=str(folder / "true.toml"), world=PLAIN), folder=folder)
    assert flight.fly(lively).error is None
    flight.close()
    return folder


def fit(*arguments):
    return CliRunner().invoke(app, ["dataset", "fit", *map(str, arguments)])


def test_the_numbers_of_a_changed_vehicle_come_back_from_its_log(flight_folder, tmp_path):
    fitted, image = tmp_path / "fitted.toml", tmp_path / "fit.png"
    done = fit(flight_folder / "flight.ulg", "--mass", MASS_KG, "-o", fitted, "--picture", image)
    assert done.exit_code == 0, done.output
    found, true = values(load_airframe(str(fitted))), values(load_airframe(str(flight_folder / "true.toml")))
    assert {name: abs(found[name] / true[name] - 1) < WITHIN[name] for name in WITHIN} == dict.fromkeys(WITHIN, True)
    before_after = [line.split("│")[2:4] for line in done.output.splitlines() if line.startswith(("│ vel", "│ rates"))]
    assert len(before_after) == 2
    assert all(float(after) < 0.5 * float(before) for before, after in before_after)
    assert image.read_bytes().startswith(b"\x89PNG")
    text = fitted.read_text()
    assert 'source = "weighed: given to the fit"' in text
    assert "fitted to" in text.split("thrust_n_s2")[1].splitlines()[0]
    Flight(FlightConfig(airframe=str(fitted))).close()


def test_truth_is_not_read():
    assert not [topic for topic in TOPICS if "groundtruth" in topic]


def ulog(path, topics, seconds=30):
    log = UlogWriter(path, 0, {"sys_name": "PX4"}, {})
    times = np.arange(1, seconds * 50) * 20_000
    added = []
    for name, fields in topics.items():
        kinds = {key: f"float[{len(value)}]" if isinstance(value, tuple) else "float" for key, value in fields.items()}
        added.append((log.add_topic(name, kinds), fields))
    for topic, fields in added:
        topic.write({"timestamp": times, **{key: np.array([value] * len(times)) for key, value in fields.items()}})
    log.close()
    return path


@pytest.mark.parametrize("topic", ["vehicle_local_position", "vehicle_attitude", "vehicle_angular_velocity"])
def test_a_log_without_a_topic_is_refused_by_its_name(tmp_path, topic):
    log = ulog(tmp_path / "px4.ulg", {name: fields for name, fields in STILL.items() if name != topic})
    done = fit(log, "-o", tmp_path / "fitted.toml")
    assert done.exit_code == 2
    assert f"px4.ulg: has no topic {topic}" in done.output
    assert [path.name for path in tmp_path.iterdir()] == ["px4.ulg"]


def changed_log(tmp_path, **topics):
    return ulog(tmp_path / "px4.ulg", STILL | topics)


REFUSED = {
    "without motors": (
        lambda p: ulog(p / "px4.ulg", dict(list(STILL.items())[:3])),
        "has no topic actuator_motors nor",
    ),
    "of six motors": (lambda p: changed_log(p, actuator_motors={"control": (0.6,) * 6}), "drives 6 motors, and the"),
    "too short": (lambda p: ulog(p / "px4.ulg", STILL, 5), "4 whole seconds in the air, of 20 that a fit needs"),
    "on the ground": (
        lambda p: changed_log(p, vehicle_land_detected={"landed": 1.0}),
        "0 whole seconds in the air",
    ),
    "not numbers": (
        lambda p: changed_log(p, vehicle_angular_velocity={"xyz": (float("nan"),) * 3}),
        "no two rows of numbers",
    ),
    "no log": (lambda p: p / "none.ulg", "none.ulg: no such file or folder"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_fitted_is_refused_and_nothing_is_left(tmp_path, what):
    make, sentence = REFUSED[what]
    done = fit(make(tmp_path), "-o", tmp_path / "fitted.toml", "--picture", tmp_path / "fit.png")
    assert done.exit_code == 2
    assert sentence in " ".join(done.output.split())
    assert not [path for path in tmp_path.iterdir() if path.name != "px4.ulg"]


def test_wrong_options_are_refused(flight_folder, tmp_path):
    log = flight_folder / "flight.ulg"
    for arguments, sentence in (
        (("-o", tmp_path / "fitted.yaml"), "an airframe's file ends with .toml"),
        (("-o", tmp_path / "none" / "fitted.toml"), "its folder does not exist"),
        (("-o", tmp_path / "fitted.toml", "--airframe", "rover"), "only multirotors can be fitted"),
        (("-o", tmp_path / "fitted.toml", "--airframe", "none"), "unknown airframe 'none'"),
        ((log, "-o", tmp_path / "fitted.toml"), "holds the same as"),
    ):
        done = fit(log, *arguments)
        assert done.exit_code == 2
        assert sentence in " ".join(done.output.split())
    assert not list(tmp_path.iterdir())
