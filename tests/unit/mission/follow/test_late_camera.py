"""Pictures on their way: late, irregular, lost, and never in the wrong order."""

import numpy as np
import pytest

from common.image_stream import ImageFrame
from mission.follow.late_camera import LateCamera
from policies.tasks.follow_me.flown_cast import params_row

FRAME_US, IMAGE_US = 20_000, 100_000


def come(pictures: int = 200, **numbers: float) -> list[tuple[int, int]]:
    """When each picture came and when it was taken [us]."""
    camera, found, now_us = LateCamera(params_row(numbers), 5), [], 0
    camera.add_sink(lambda frame: found.append((now_us, frame.time_us)))
    for step in range(pictures * IMAGE_US // FRAME_US):
        now_us = step * FRAME_US
        if now_us % IMAGE_US == 0:
            camera.publish(
                ImageFrame(now_us, 1 + now_us // IMAGE_US, np.zeros((1, 1, 4), np.uint8), 90.0, 0.0, 4.0), now_us
            )
        camera.frame(now_us)
    return found


def test_by_default_each_comes_at_once() -> None:
    assert come(20) == [(k * IMAGE_US, k * IMAGE_US) for k in range(20)]


@pytest.mark.parametrize("lag_s", [0.1, 0.3])
def test_late_pictures_are_late_by_so_much(lag_s: float) -> None:
    ages_us = {now_us - taken_us for now_us, taken_us in come(image_lag_s=lag_s)}
    assert ages_us == {round(lag_s * 1e6)}


def test_an_older_picture_never_comes_after_a_newer_one() -> None:
    taken = [taken_us for _, taken_us in come(image_lag_s=0.1, image_jitter_s=0.3)]
    assert taken == sorted(set(taken))
    assert len(taken) > 80


def test_so_many_are_lost_as_are_said_to_be() -> None:
    lost = 1.0 - len(come(1000, image_loss=0.3)) / 1000
    assert lost == pytest.approx(0.3, abs=0.05)


def test_pictures_that_freeze_do_so_for_about_a_second() -> None:
    times = np.array([now_us for now_us, _ in come(600, image_freezes_per_min=6.0)]) * 1e-6
    gaps = np.diff(times)
    assert 4 <= (gaps > 0.35).sum() <= 8
    assert gaps.max() < 1.5


def test_a_number_that_there_is_not_is_refused() -> None:
    with pytest.raises(KeyError):
        params_row({"picture_lags": 1.0})
