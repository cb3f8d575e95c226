"""What a day outside brings, in batch: late pictures, others who cross, owners who hide, depth that is missing."""

import numpy as np
import pytest

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.follow_me.follow_me import FollowMe


def _task(count: int, numbers: dict[str, float], **settings: str) -> FollowMe:
    task = build_task("FollowMe", count, task_settings("FollowMe", settings))
    assert isinstance(task, FollowMe)
    task.set_params(numbers)
    task.reset(5)
    return task


def test_pictures_are_shown_as_late_as_they_come_and_the_vector_tells_their_age() -> None:
    prompt, late = _task(2, {}, image_size="16"), _task(2, {"image_lag_s": 0.2}, image_size="16")
    taken = [prompt.buffers.images.numpy().copy()]
    for k in range(5):
        prompt.step()
        late.step()
        taken.append(prompt.buffers.images.numpy().copy())
        if k >= 1:
            assert (late.buffers.images.numpy() == taken[k - 1]).all()
    names = [element.name for element in late.layout.frame]
    age = (
        late.buffers.observations.numpy()[:, names.index("image_age")]
        * late.layout.frame[names.index("image_age")].scale
    )
    assert age == pytest.approx([0.2, 0.2])


def test_an_owner_who_hides_is_in_no_picture_and_is_there_again_afterwards() -> None:
    task = _task(16, {"owner_hides_per_min": 20.0, "owner_hide_s": 1.0}, observation="state", has_estimator="false")
    shares = []
    for _ in range(60):
        task.step()
        is_hidden = task.follow.drawn.numpy()[:, 0]["stature_m"] == 0.0
        assert not task.measures.numpy()[is_hidden, 2].any()
        shares.append(is_hidden.mean())
    assert np.mean(shares) == pytest.approx(1.0 / 3.0, abs=0.15)  # a second of each three


def test_so_many_others_are_there_as_are_asked_for() -> None:
    for count in (0, 2, 3):
        task = _task(8, {"bystanders": float(count)}, observation="state", has_estimator="false")
        there = task.follow.bystanders.numpy()["stature_m"] > 0.0
        assert (there.sum(axis=1) == count).all()


def test_clothes_are_the_usual_unless_asked_for_otherwise() -> None:
    usual = _task(16, {}, observation="state", has_estimator="false").follow.clothes.numpy()[:, 0]["shirt"]
    others = _task(16, {"owner_clothes_fraction": 1.0}, observation="state", has_estimator="false")
    red = _task(4, {"owner_hue": 0.0}, observation="state", has_estimator="false").follow.clothes.numpy()[:, 0]["shirt"]
    assert (usual == usual[0]).all()
    assert len({tuple(row) for row in others.follow.clothes.numpy()[:, 0]["shirt"].tolist()}) == 16
    assert (red[:, 0] > 5.0 * red[:, 1]).all()
    assert (red[:, 0] > 5.0 * red[:, 2]).all()


def test_depth_ends_where_it_is_said_to_end() -> None:
    near, none = (_task(2, {"depth_max_m": far_m}, image_size="16") for far_m in (5.0, 0.0))
    assert (none.buffers.images.numpy()[..., 3] == 255).all()
    depth = near.buffers.images.numpy()[..., 3]
    assert (depth[depth < 255] <= 255.0 * 5.5 / 9.5).all()
    assert (depth < 255).any()
