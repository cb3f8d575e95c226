"""A kept log as an MCAP file: `honeyguide mcap`.

In: a ULog of ours, or PX4's. Out: the channels that can be made from it: no camera and no ring, which no log holds; the
scene where the log says what the flight was made from.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError
from pyulog import ULog

from common.airframe import AirframeError, load_airframe
from common.geodesy import DEFAULT_HOME
from mission.flight_config import FlightConfig
from mission.foxglove.channels import MOVING, PLAN, VEHICLE_SHAPE, WORLD
from mission.foxglove.mcap_file import McapFile
from mission.foxglove.publisher import Publisher
from mission.foxglove.scene import MovingScene, plan_scene, vehicle_scene, world_scene
from mission.foxglove.ulog_states import UlogStates
from mission.foxglove.vehicle_state import VehicleState
from mission.log.ulog_file import UlogDamage, read_topics
from mission.simulator.flight_rig import flight_world
from mission.view.replay_file import CONFIG_KEY, PATH_KEY, config_of, info_text
from sim.world.world import WorldMap

TOPICS = (
    "actuator_motors", "actuator_servos", "battery_status", "estimator_innovation_variances",
    "estimator_innovations", "replay_frame", "sensor_gps", "vehicle_angular_velocity",
    "vehicle_angular_velocity_groundtruth", "vehicle_attitude", "vehicle_attitude_groundtruth",
    "vehicle_attitude_setpoint", "vehicle_gps_position", "vehicle_local_position",
    "vehicle_local_position_groundtruth", "vehicle_local_position_setpoint", "vehicle_rates_setpoint",
    "vehicle_status",
)  # fmt: skip


class ConversionError(ValueError):
    """A log of which no MCAP file can be made; the message is one sentence."""


def convert(log: Path, target: Path) -> int:
    """Writes the MCAP file of a log and returns how many moments it holds.

    Raises:
        ConversionError: the log holds no flight, or a file cannot be read or written.
    """
    try:
        ulog = read_topics(log, TOPICS)
        config = _config(ulog, log.parent)
        states = UlogStates(ulog, DEFAULT_HOME if config is None else config.home)
        if not states.times():
            raise ConversionError(f"{log}: holds no attitude and no position")
    except UlogDamage as error:
        raise ConversionError(str(error)) from error
    except OSError as error:
        raise ConversionError(f"{log}: cannot be read: {error.strerror}") from error
    try:
        file = McapFile(target)
    except OSError as error:
        raise ConversionError(f"{target}: cannot be written: {error.strerror}") from error
    try:
        return _write(Publisher(file.context), states, config, ulog)
    finally:
        file.close()


def _write(publisher: Publisher, states: UlogStates, config: FlightConfig | None, ulog: ULog) -> int:
    """All moments, and the texts between them."""
    world = None if config is None else flight_world(config)
    moving = MovingScene(world)
    texts = iter(states.texts)
    text = next(texts, None)
    count = 0
    for state in states:
        now_us = state.time_us
        if count == 0:
            _write_scene(publisher, world, config, ulog, now_us)
        publisher.publish(state, [])
        _write_moving(publisher, moving, state)
        while text is not None and text.time_us <= now_us:
            publisher.text(*text, now_us)
            text = next(texts, None)
        count += 1
    return count


def _write_moving(publisher: Publisher, moving: MovingScene, state: VehicleState) -> None:
    update = moving.update(state) if publisher.channels.is_due(MOVING, state.time_us) else None
    if update is not None:
        publisher.channels.log(MOVING, update, state.time_us)


def _write_scene(
    publisher: Publisher, world: WorldMap | None, config: FlightConfig | None, ulog: ULog, now_us: int
) -> None:
    """What stands still, where the log says what it was."""
    if world is None or config is None:
        return
    publisher.channels.log(WORLD, world_scene(world, now_us), now_us)
    publisher.channels.log(VEHICLE_SHAPE, vehicle_scene(load_airframe(config.airframe), now_us), now_us)
    path_ned: Any = np.array(json.loads(info_text(ulog, PATH_KEY)), np.float32).reshape(-1, 3)
    if len(path_ned):
        publisher.channels.log(PLAN, plan_scene(path_ned, now_us), now_us)


def _config(ulog: ULog, folder: Path) -> FlightConfig | None:
    """What the flight was made from; None: the log does not say it, or says it in the words of another version."""
    try:
        config = config_of(info_text(ulog, CONFIG_KEY), folder)
        load_airframe(config.airframe)
    except (KeyError, IndexError, ValueError, ValidationError, AirframeError):
        return None
    return config
