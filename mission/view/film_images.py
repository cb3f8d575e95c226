"""The images of a film: the chase camera's view, what the vehicle itself sees, and a line of figures.

In: a recording and its world. Out: images in their order, 25 a second of flight. Each is made on one core, and as
many at a time as there are cores: the camera's kernels and OpenCV let other threads run.
"""

import os
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue

import cv2
import numpy as np
from numpy.typing import NDArray

from common.airframe import load_airframe
from mission.view.box_painter import BoxPainter
from mission.view.chase_camera import STRIDE, Floats, camera_path, looking
from mission.view.flight_snapshot import Moment, Row
from mission.view.replay_file import Recording
from mission.view.snapshot_images import Eye, onboard_eye
from mission.view.vehicle_model import VehicleModel, turned_rad
from sim.world.world import WorldMap

WIDTH, HEIGHT, HFOV_DEG = 960, 540, 75.0
RANGE_M = 150.0
INSET = 192  # [pixels] side of the onboard image
MARGIN = 16
STRIP, FONT_SCALE = 36, 0.7  # [pixels] height of the caption, and the size of its letters
AHEAD = 4  # images that each core may be ahead of who takes them
Image = NDArray[np.uint8]


def film(recording: Recording, world: WorldMap) -> Iterator[Image]:
    """The images, RGB, (HEIGHT, WIDTH, 3), one each `chase.IMAGE_S`."""
    recording = recording.every(STRIDE)
    places, targets = camera_path(recording, world)
    turned = [turned_rad(each.rows) for each in (recording, *recording.others)]
    cores = len(os.sched_getaffinity(0))
    studios: SimpleQueue[Studio] = SimpleQueue()
    for _ in range(cores):
        studios.put(Studio(recording, world))

    def taken(i: int) -> Image:
        studio = studios.get()
        try:
            others = [other.rows[i] for other in recording.others]
            return studio.image(recording.moment(i), others, places[i], targets[i], [each[i] for each in turned])
        finally:
            studios.put(studio)

    with ThreadPoolExecutor(cores, "film") as pool:
        waiting: deque[Future[Image]] = deque()
        try:
            for i in range(len(recording)):
                waiting.append(pool.submit(taken, i))
                if len(waiting) > AHEAD * cores:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)


class Studio:
    """Makes one image at a time."""

    def __init__(self, recording: Recording, world: WorldMap) -> None:
        self._chase = Eye(world, WIDTH, HEIGHT, HFOV_DEG, range_m=RANGE_M)
        self._onboard = onboard_eye(world)
        self._boxes = BoxPainter(world)
        airframes = [load_airframe(each.config.airframe) for each in (recording, *recording.others)]
        self._model, *self._others = [VehicleModel(airframe) for airframe in airframes]

    def image(
        self, moment: Moment, others: Sequence[Row], place: Floats, target: Floats, turned: Sequence[Floats]
    ) -> Image:
        """A recorded moment, seen from a place [m] towards a target.

        Args:
            moment: of the vehicle.
            others: rows of other vehicles, which are not in the onboard image.
            place: of the camera [m], ned.
            target: where it looks [m], ned.
            turned: the wheels of the vehicle and of the others [rad].
        """
        row = moment.row
        q_ned_from_rdf = looking(place, target)
        self._chase.look(place, q_ned_from_rdf, row["owner"])
        image: Image = self._chase.rgb.copy()
        self._boxes.draw(image, self._chase, moment.tick, place, q_ned_from_rdf)
        for model, other, wheels in zip(self._others, others, turned[1:], strict=True):
            model.draw(image, self._chase, other, place, q_ned_from_rdf, wheels)
        self._model.draw(image, self._chase, row, place, q_ned_from_rdf, turned[0])
        place_on_board, q_on_board = self._onboard.look_from(row)
        seen: Image = self._onboard.rgb.copy()
        self._boxes.draw(seen, self._onboard, moment.tick, place_on_board, q_on_board)
        inset = cv2.resize(seen, (INSET, INSET), interpolation=cv2.INTER_NEAREST)
        image[MARGIN : MARGIN + INSET, -MARGIN - INSET : -MARGIN] = inset
        corner = (WIDTH - MARGIN - INSET - 1, MARGIN - 1)
        cv2.rectangle(image, corner, (WIDTH - MARGIN, MARGIN + INSET), (255, 255, 255), 1)
        write_caption(image, caption(moment, drives=self._model.drives))
        return image


def caption(moment: Moment, *, drives: bool = False) -> str:
    """Clock and mode; the distance to the owner, or speed and, of what flies, height where nobody is followed."""
    minutes, tenths = divmod(int(10.0 * moment.time_s), 600)
    if moment.has_owner:
        figures = f"{moment.distance_m:.1f} m to the owner"
    elif drives:
        figures = f"{moment.speed_m_s:.1f} m/s"
    else:
        figures = f"{moment.speed_m_s:.1f} m/s   {float(moment.row['height_m']):.1f} m high"
    return f"{minutes}:{0.1 * tenths:04.1f}   {moment.mode_name}   {figures}"


def write_caption(image: Image, text: str) -> None:
    """White letters on a darkened strip along the lower edge: to be read before sky and forest."""
    image[-STRIP:] >>= 1
    foot = (MARGIN, HEIGHT - STRIP // 3)
    cv2.putText(image, text, foot, cv2.FONT_HERSHEY_SIMPLEX, FONT_SCALE, (255, 255, 255), 1, cv2.LINE_AA)
