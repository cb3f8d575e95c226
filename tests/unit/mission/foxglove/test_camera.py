"""The camera's messages: the image decodes, the points lie where the pixels look, the model is that of the lens."""

from math import inf, radians, tan

import cv2
import numpy as np
import pytest

from mission.foxglove.camera import (
    IMAGE_SIZE,
    POINT,
    POINT_STEP,
    Shot,
    calibration_of,
    cloud,
    jpeg_of,
    points_of,
    publish,
)
from mission.foxglove.channel_set import ChannelSet
from mission.foxglove.mcap_file import McapFile
from tests.unit.mission.foxglove.mcap_messages import read, us_of

HFOV_DEG = 80.0


def shot(depth_m=5.0, size=IMAGE_SIZE):
    width, height = size
    rgb = np.zeros((height, width, 3), np.uint8)
    rgb[:, : width // 2] = (200, 30, 60)
    return Shot(40_000, rgb, np.full((height, width), depth_m, np.float32), HFOV_DEG, (0.5, 0.5, 0.5, 0.5))


@pytest.fixture
def messages(tmp_path):
    file = McapFile(tmp_path / "flight.mcap")
    publish(ChannelSet(file.context), shot(), 60_000)
    file.close()
    return read(tmp_path / "flight.mcap")


def test_the_image_decodes(messages):
    (message,) = messages["/camera/image"]
    image = cv2.imdecode(np.frombuffer(message.value.data, np.uint8), cv2.IMREAD_COLOR)
    assert (message.schema, message.value.format, image.shape) == ("foxglove.CompressedImage", "jpeg", (180, 320, 3))
    assert image[90, 40].tolist() == pytest.approx([60, 30, 200], abs=8)  # OpenCV's order is blue, green, red
    assert (message.time_us, us_of(message.value.timestamp)) == (60_000, 40_000)


def test_the_model_sees_the_edge_of_the_image_where_the_lens_does(messages):
    (message,) = messages["/camera/calibration"]
    focal, middle = message.value.K[0], message.value.K[2]
    assert (message.value.width, message.value.height) == IMAGE_SIZE
    assert middle / focal == pytest.approx(tan(radians(0.5 * HFOV_DEG)))


def test_the_points_fit_their_size(messages):
    (message,) = messages["/camera/points"]
    width, height = IMAGE_SIZE
    value = message.value
    assert value.point_stride == POINT.itemsize == 16
    assert len(value.data) == 16 * (width // POINT_STEP) * (height // POINT_STEP)
    assert [(field.name, field.offset) for field in value.fields] == [
        (name, POINT.fields[name][1]) for name in POINT.names
    ]


def test_a_point_projects_to_its_pixel():
    seen = shot(depth_m=7.0)
    points, k = cloud(seen), calibration_of(seen)
    assert points["z"] == pytest.approx(7.0)
    focal = 0.5 * IMAGE_SIZE[0] / tan(radians(0.5 * HFOV_DEG))
    columns = points["x"] / points["z"] * focal + 0.5 * IMAGE_SIZE[0]
    assert sorted(set(np.round(columns, 3).tolist()))[:2] == pytest.approx([0.5, POINT_STEP + 0.5], abs=1e-3)
    is_left = points["x"] < -0.1
    assert (points["red"][is_left] == 200).all()
    assert (points["red"][points["x"] > 0.1] == 0).all()
    assert k is not None


def test_what_is_far_or_nowhere_is_no_point():
    assert len(cloud(shot(depth_m=inf))) == 0
    assert len(points_of(shot(depth_m=500.0)).encode()) < 400
    assert len(jpeg_of(shot()).encode()) > 500


def test_a_small_image_keeps_every_pixel():
    assert len(cloud(shot(size=(64, 64)))) == 64 * 64
