"""A recorded flight as one HTML file that needs nothing else: no network, no server, no library.

In: a recording and its world. Out: the page `web/replay.html` with the data inside: scene, paths, plots and
the onboard images, one sheet of small JPEGs. A minute's flight makes about half a megabyte.
"""

import json
from base64 import b64encode
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from common.airframe import load_airframe
from common.files import write_whole
from mission.log.euler_angles import yaw_rad
from mission.view import shapes
from mission.view.flight_snapshot import distances_m
from mission.view.panel import ACTION_NAMES
from mission.view.replay_file import Recording
from mission.view.snapshot_images import onboard_eye
from mission.view.vehicle_model import turned_rad
from mission.view.web.page_arrays import Json, array_data, mesh_data
from sim.world.people import STATURE_M
from sim.world.world import WorldMap

STRIDE = 5  # frames of the flight per moment of the page: 10 a second
TILES_MOST = 600  # onboard images
TILES_PER_S = 5
TILE_COLUMNS = 20
CELLS_MOST = 128
JPEG_QUALITY = 80


def write_html(recording: Recording, world: WorldMap, target: Path, title: str) -> None:
    """Writes the file.

    Raises:
        OSError: it cannot be written.
    """
    page, webgl = (
        files("mission.view.web").joinpath(name).read_text(encoding="utf-8") for name in ("replay.html", "webgl.js")
    )
    data = json.dumps(page_data(recording.every(STRIDE), world, title)).replace("</", "<\\/")
    write_whole(target, page.replace("/*WEBGL*/", webgl).replace("/*DATA*/", data).encode())


def page_data(recording: Recording, world: WorldMap, title: str) -> Json:
    """Everything the page shows; the border to its JavaScript, hence a dict."""
    shape = shapes.vehicle(load_airframe(recording.config.airframe))
    rows = recording.rows
    return {
        "title": title,
        "modes": recording.modes,
        "size_m": world.config.size_m,
        "sun_ned": shapes.SUN_NED.tolist(),
        "heading_rad": float(yaw_rad(rows["q_ned_from_frd"][:1].astype(float))[0]),
        "has_owner": recording.has_owner,
        "ground": mesh_data(shapes.ground(world, CELLS_MOST)),
        "walls": None if (walls := shapes.walls(world)) is None else mesh_data(walls),
        **_trees(world),
        "vehicle": mesh_data(shape.body),
        "blade": mesh_data(shape.blade),
        "boxes": None if (boxes := shapes.standing(world)) is None else mesh_data(boxes),
        "movers": _movers(recording, world),
        "others": [_other(other) for other in recording.others],
        "wheel": mesh_data(shape.wheels[0]) if shape.drives else None,
        "wheel_hubs": array_data(shape.wheel_hubs),
        "is_steered": list(shape.is_steered),
        "away_m": 3.0 if shape.drives else 7.0,
        "person": mesh_data(shapes.person(float(STATURE_M))),
        "hubs": array_data(shape.hubs),
        "spins": list(shape.spins),
        "path_ned": array_data(recording.path_ned) if len(recording.path_ned) > 1 else None,
        "track": _track(rows),
        "plots": _plots(recording, drives=shape.drives),
        "onboard": _onboard(recording, world),
    }


def _trees(world: WorldMap) -> Json:
    forest = shapes.trees(world)
    if len(forest.trunk_ned) == 0:
        return {"trunks": None}
    bark = np.broadcast_to(np.array(shapes.BARK, np.uint8), forest.crown_colours.shape)
    return {
        "trunk": mesh_data(shapes.trunk()),
        "ball": mesh_data(shapes.ball()),
        "trunks": {
            "place": array_data(forest.trunk_ned),
            "size": array_data(forest.trunk_size),
            "tint": array_data(bark),
        },
        "crowns": {
            "place": array_data(forest.crown_ned),
            "size": array_data(forest.crown_size),
            "tint": array_data(forest.crown_colours),
        },
    }


def _track(rows: NDArray[Any]) -> Json:
    names = ("time_s", "pos_ned", "q_ned_from_frd", "motor_speed", "steering_rad", "mode", "is_armed")
    return {name: array_data(rows[name]) for name in names} | {
        "turned_rad": array_data(turned_rad(rows).astype(np.float32)),
        "owner_ned": array_data(rows["owner"]["pos_ned"]),
        "owner_heading_rad": array_data(rows["owner"]["heading_rad"]),
    }


def _movers(recording: Recording, world: WorldMap) -> list[Json]:
    """Boxes that run to and fro, and where they are [m] at each moment."""
    ticks = [recording.moment(i).tick for i in range(len(recording))]
    movers = shapes.moving_boxes(world)
    places = np.array([world.boxes.middle(tick) for tick in ticks]) if movers else None
    return [
        {"mesh": mesh_data(mesh), "place": array_data(places[:, i].astype(np.float32))}
        for i, mesh in movers
        if places is not None
    ]


def _other(recording: Recording) -> Json:
    """Another vehicle in one piece, and where it is at each moment."""
    shape = shapes.vehicle(load_airframe(recording.config.airframe))
    turning = [(shape.blade, hub - (0.0, 0.0, 0.03)) for hub in shape.hubs]
    turning += zip(shape.wheels, shape.wheel_hubs, strict=True)
    parts = [shapes.Mesh((mesh.vertices + hub).astype(np.float32), mesh.faces, mesh.colours) for mesh, hub in turning]
    return {
        "mesh": mesh_data(shapes.joined([shape.body, *parts])),
        "place": array_data(recording.rows["pos_ned"]),
        "attitude": array_data(recording.rows["q_ned_from_frd"]),
    }


def _plots(recording: Recording, *, drives: bool) -> list[Json]:
    rows = recording.rows
    plots: list[tuple[str, tuple[str, ...], list[NDArray[Any]]]] = [
        ("height above ground [m]", ("height",), [rows["height_m"]]),
        ("speed [m/s]", ("speed",), [np.linalg.norm(rows["vel_ned"], axis=1)]),
        ("battery [%]", ("battery",), [100.0 * rows["battery"]]),
    ]
    if drives:
        del plots[0]
    if recording.has_owner:
        plots.insert(0, ("distance to owner [m]", ("distance",), [distances_m(rows)]))
        plots.append(("action", ACTION_NAMES, list(rows["action"].T)))
    return [
        {"title": title, "names": names, "columns": [array_data(column) for column in columns]}
        for title, names, columns in plots
    ]


def _onboard(recording: Recording, world: WorldMap) -> Json:
    """The onboard camera's images side by side, row by row."""
    stride = max(10 // TILES_PER_S, -(-len(recording) // TILES_MOST))
    eye = onboard_eye(world)
    side = len(eye.rgb)
    rows = recording.rows[::stride]
    sheet = np.zeros((-(-len(rows) // TILE_COLUMNS) * side, TILE_COLUMNS * side, 3), np.uint8)
    for i, row in enumerate(rows):
        eye.look_from(row)
        top, left = i // TILE_COLUMNS * side, i % TILE_COLUMNS * side
        sheet[top : top + side, left : left + side] = eye.rgb
    _, jpeg = cv2.imencode(".jpg", sheet[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
    text = b64encode(jpeg.tobytes()).decode()
    return {"sheet": text, "side": side, "columns": TILE_COLUMNS, "count": len(rows), "stride": stride}
