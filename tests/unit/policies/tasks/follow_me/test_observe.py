"""The vector, the image and the command of a follow-me policy, as a companion launches them: one row."""

import math
from typing import Any

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

from common.attitude import rotated
from policies.tasks.flight.own_state import Command, OwnState, command_rows
from policies.tasks.follow_me.observe import (
    DOCUMENT,
    EGO,
    EGO_BLIND,
    OwnerReport,
    camera_mount,
    observe_rows,
    pack_images,
    vector_elements,
)


def _own(yaw: float = 0.0) -> Any:
    own = OwnState()
    own.pos_ned = wp.vec3(10.0, 20.0, -2.0)
    own.vel_ned = wp.vec3(0.0, 3.0, 1.0)
    own.q_ned_from_frd = wp.quat(0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
    own.yaw_rate = 0.5
    own.height_m = 1.8
    own.is_height_valid = 1
    return own


def _report() -> Any:
    report = OwnerReport()
    report.pos_ned = wp.vec3(10.0, 23.0, -1.0)
    report.vel_ned = wp.vec3(0.0, 2.0, 0.0)
    report.age_s = 0.5
    report.is_known = 1
    return report


def _vector(kind: int, own: Any, report: Any) -> dict[str, float]:
    out = wp.zeros((1, len(vector_elements(kind))), dtype=float)
    action = wp.array([wp.vec4(0.1, 0.2, 0.3, 0.4)], dtype=wp.vec4)
    rows = [wp.array([own], dtype=OwnState), wp.array([report], dtype=OwnerReport)]
    wp.launch(observe_rows, dim=1, inputs=[kind, *rows, action, wp.array([0.2], dtype=float)], outputs=[out])
    elements = vector_elements(kind)
    return {e.name: float(x) * e.scale for e, x in zip(elements, out.numpy()[0], strict=True)}


def test_owner_to_the_east_is_ahead_of_a_vehicle_that_heads_east() -> None:
    seen = _vector(int(EGO), _own(0.5 * math.pi), _report())
    place = [seen[f"owner_pos_hfrd_{axis}"] for axis in "xyz"]
    assert place == pytest.approx([4.0, 0.0, 1.0], abs=1e-5)  # 3 m, and 1 m walked in the half second since
    assert seen["owner_vel_hfrd_x"] == pytest.approx(2.0, abs=1e-5)
    assert seen["vel_hfrd_x"] == pytest.approx(3.0, abs=1e-5)
    assert seen["vel_hfrd_z"] == pytest.approx(1.0)
    assert (seen["yaw_rate"], seen["height"]) == pytest.approx((0.5, 1.8))


def test_unknown_owner_leaves_no_trace_in_the_vector() -> None:
    silent = OwnerReport()
    lost = _report()
    lost.is_known = 0
    assert _vector(int(EGO), _own(), lost) == _vector(int(EGO), _own(), silent)
    assert not any(value for name, value in _vector(int(EGO), _own(), lost).items() if "owner" in name)


def test_blind_vector_names_no_owner_and_is_the_first_part_of_the_whole_one() -> None:
    blind, whole = _vector(int(EGO_BLIND), _own(), _report()), _vector(int(EGO), _own(), _report())
    assert not any("owner" in name for name in blind)
    assert blind == {name: whole[name] for name in blind}


def test_documented_numbers_are_person_drone_and_their_distance_with_y_up() -> None:
    seen = list(_vector(int(DOCUMENT), _own(), _report()).values())
    assert seen == pytest.approx([23.0, 1.0, 10.0, 20.0, 2.0, 10.0, math.hypot(3.0, 1.0)])


def test_action_asks_for_velocity_along_the_heading() -> None:
    commands = wp.zeros(1, dtype=Command)
    action = wp.array([wp.vec4(1.0, 0.0, -0.5, 0.25)], dtype=wp.vec4)
    own = wp.array([_own(0.5 * math.pi)], dtype=OwnState)
    wp.launch(command_rows, dim=1, inputs=[action, own], outputs=[commands])
    row = commands.numpy()[0]
    assert row["vel_ned"] == pytest.approx([0.0, 7.0, -1.0], abs=1e-5)
    assert row["yaw_rate"] == pytest.approx(0.5)


def test_camera_looks_ahead_and_ten_degrees_down() -> None:
    q = camera_mount()
    tilt = math.radians(10.0)
    assert rotated(q, (0.0, 0.0, 1.0)) == pytest.approx((math.cos(tilt), 0.0, math.sin(tilt)))
    assert rotated(q, (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))


def test_depth_channel_grows_with_depth_up_to_the_sky() -> None:
    depth_m = wp.array([[[0.0, 4.0, 12.0, 4000.0]]], dtype=float)
    rgb = wp.array(np.arange(12, dtype=np.uint8).reshape(1, 1, 4, 3), dtype=wp.uint8)
    images = wp.zeros((1, 1, 4, 4), dtype=wp.uint8)
    wp.launch(pack_images, dim=(1, 1), inputs=[rgb, depth_m, wp.array([True], dtype=wp.bool), images])
    packed: NDArray[np.uint8] = images.numpy()
    assert packed[0, 0, :, 3].tolist() == [0, 127, 191, 255]
    assert packed[0, 0, :, :3].tolist() == rgb.numpy()[0, 0].tolist()
