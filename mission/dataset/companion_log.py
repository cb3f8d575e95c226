"""What notes the decisions of a companion: rows of a ULog's topic, and the images beside them.

In: decisions as they are made. Out: the topic `policy_decision`, and `images.zip`, one deflated array per image,
without loss. A disk that is full ends the images, and is told; it ends no flight. Nothing here knows the simulator.
"""

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from common.files import PartFile
from common.logs.ulog import UlogWriter
from policies.companion.companion import Companion
from policies.companion.decision_log import TOPIC, Decision, topic_fields, topic_info, topic_row

IMAGES_FILE = "images.zip"
COMPANION_LOG = "decisions.ulg"
_FIRST_DAY = (1980, 1, 1, 0, 0, 0)  # a ZIP's files have dates; the same flight is to give the same bytes
_LEVEL = 1  # of deflate: quick


class ImageFile:
    """The images of a flight, numbered from 0.

    Args:
        path: of the file; it appears when it is complete.
        on_trouble: is told when it cannot be written, which then ends.
    """

    def __init__(self, path: Path, on_trouble: Callable[[str], None]) -> None:
        self._path, self._on_trouble = path, on_trouble
        self._part: PartFile | None = None
        self._zip: zipfile.ZipFile | None = None
        self._count = 0
        self._last: NDArray[np.uint8] | None = None
        self._has_failed = False

    def add(self, image: NDArray[np.uint8]) -> int:
        """The number of an image, which is written unless it is the one before; -1: it could not be."""
        if self._has_failed:
            return -1
        if self._last is not image:
            try:
                self._write(image)
            except OSError as error:
                self._fail(error)
                return -1
            self._last = image
        return self._count - 1

    def _write(self, image: NDArray[np.uint8]) -> None:
        if self._zip is None:
            self._part = PartFile(self._path)
            self._zip = zipfile.ZipFile(self._part.stream, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL)
        name = zipfile.ZipInfo(f"{self._count:07d}.npy", _FIRST_DAY)
        name.compress_type = zipfile.ZIP_DEFLATED
        with self._zip.open(name, "w") as file:
            npy.write_array(file, np.ascontiguousarray(image), allow_pickle=False)
        self._count += 1

    def close(self) -> None:
        """Completes the file, if there is one."""
        if self._zip is None or self._part is None or self._has_failed:
            return
        try:
            self._zip.close()
            self._part.close()
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        self._has_failed = True
        self._on_trouble(f"{self._path.name} ended: {error.strerror or error}")


def read_image(archive: zipfile.ZipFile, number: int) -> NDArray[np.uint8]:
    """One image of an `ImageFile`.

    Raises:
        KeyError: there is none of this number.
    """
    with archive.open(f"{number:07d}.npy") as file:
        image: NDArray[np.uint8] = npy.read_array(file, allow_pickle=False)
    return image


class DecisionRecording:
    """Notes the decisions of a companion until it is closed.

    Args:
        companion: that decides; nothing has been received.
        write_row: writes a row of the topic: its time [us], its values.
        images: where images go; None: nowhere.
    """

    def __init__(self, companion: Companion, write_row: Callable[..., None], images: ImageFile | None) -> None:
        companion.skill.keep_records()
        companion.on_decision = self._note
        self._write_row, self._images, self._stances = write_row, images, companion.skill.stances

    def _note(self, decision: Decision) -> None:
        number = -1
        if self._images is not None and decision.image is not None:
            number = self._images.add(decision.image)
        self._write_row(decision.time_us, *topic_row(decision, number, self._stances))

    def close(self) -> None:
        """Completes the images; the log is its owner's."""
        if self._images is not None:
            self._images.close()


class CompanionLog:
    """A log of a companion's own: `decisions.ulg`, and the images beside it."""

    def __init__(self, companion: Companion, folder: Path, pilot: str, tell: Callable[[str], None]) -> None:
        skill = companion.skill
        layout, image_layout = skill.record_layout, skill.image_layout
        about = topic_info(layout, pilot, skill.stances, image_layout)
        info: dict[str, Any] = {"sys_name": "honeyguide companion", **about}
        self._log = UlogWriter(folder / COMPANION_LOG, 0, info, {}, on_trouble=tell)
        topic = self._log.add_topic(TOPIC, topic_fields(layout, image_layout))
        images = ImageFile(folder / IMAGES_FILE, tell) if skill.camera is not None else None
        self._recording = DecisionRecording(companion, topic.write_row, images)

    def close(self) -> None:
        """Completes the files."""
        self._recording.close()
        self._log.close()
