"""Recordings made by hand: a vehicle that hovers behind somebody who stands; and their logs."""

import json

import numpy as np

from autopilot.interface.vehicle_state import Mode
from common.logs.ulog import UlogWriter
from mission.flight import FlightConfig
from mission.flight_config import OwnerConfig
from mission.log.motion_topics import TRUE_LOCAL_POSITION_FIELDS
from mission.log.replay_topic import REPLAY_TOPIC
from mission.view.flight_snapshot import MOMENT
from mission.view.replay_file import ATTITUDE, CONFIG_KEY, PATH_KEY, PLACE, Recording
from sim.world.world import WorldConfig

WORLD = WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=0.0)
CONFIG = FlightConfig(world=WORLD, owner=OwnerConfig())


def hovering(seconds=2.0, *, mode=Mode.OFFBOARD, distance_m=2.0):
    """The vehicle at home, 1.4 m up, level, to the north; the owner so far north of it."""
    rows = np.zeros(round(50 * seconds), MOMENT)
    rows["time_s"] = (10_000_000 + 20_000 * np.arange(len(rows))) * 1e-6
    rows["pos_ned"] = (0.0, 0.0, -1.4)
    rows["q_ned_from_frd"] = (0.0, 0.0, 0.0, 1.0)
    rows["motor_speed"][:, :4] = 600.0
    rows["height_m"] = 1.4
    rows["mode"] = mode
    rows["goal_ned"] = np.nan
    rows["owner"]["pos_ned"] = (distance_m, 0.0, 0.0)
    rows["owner"]["heading_rad"] = np.pi
    rows["owner"]["stature_m"] = 1.75
    return Recording(CONFIG, rows, np.zeros((0, 3), np.float32))


def write_log(recording, path):
    """The part of a flight log that replays are made from."""
    rows = recording.rows
    log = UlogWriter(path, 0, {"sys_name": "Honeyguide"}, {})
    log.inform(CONFIG_KEY, [recording.config.model_dump_json()])
    log.inform(PATH_KEY, [json.dumps(recording.path_ned.tolist())])
    place = log.add_topic(PLACE, TRUE_LOCAL_POSITION_FIELDS)
    attitude = log.add_topic(ATTITUDE, {"q": "float[4]"})
    shown = log.add_topic(REPLAY_TOPIC.name, REPLAY_TOPIC.fields)
    times = {"timestamp": np.round(rows["time_s"] * 1e6).astype(np.uint64)}
    axes = dict(zip(("x", "y", "z"), rows["pos_ned"].T, strict=True))
    speeds = dict(zip(("vx", "vy", "vz"), rows["vel_ned"].T, strict=True))
    place.write(
        dict.fromkeys(TRUE_LOCAL_POSITION_FIELDS, 0.0) | times | axes | speeds | {"dist_bottom": rows["height_m"]}
    )
    attitude.write(times | {"q": np.roll(rows["q_ned_from_frd"], 1, axis=1)})
    owner = {f"owner_{name}": rows["owner"][name] for name in rows["owner"].dtype.names}
    shown.write(times | owner | {name: rows[name] for name in REPLAY_TOPIC.fields if not name.startswith("owner_")})
    log.close()
