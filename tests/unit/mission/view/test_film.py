"""The film: what is in its pictures, their order, and what is told while it is made."""

import dataclasses
import io
from itertools import pairwise

import av
import numpy as np
import pytest
from rich.console import Console

from autopilot.interface.vehicle_state import Mode
from mission.simulator.flight_rig import flight_world
from mission.view import film as film_file
from mission.view.film import write_film
from mission.view.film_images import HEIGHT, INSET, MARGIN, WIDTH, caption, film
from mission.view.flight_snapshot import Moment
from tests.unit.mission.view.rows import CONFIG, hovering


@pytest.fixture(scope="module")
def world():
    return flight_world(CONFIG)


def test_the_vehicle_and_the_onboard_picture_are_in_the_film(world):
    recording = hovering(0.2)
    with_vehicle = next(film(recording, world))
    rows = recording.rows.copy()
    rows["pos_ned"][0, 2] += 0.5  # the camera hardly moves: it is an average
    lower = next(film(dataclasses.replace(recording, rows=rows), world))
    assert with_vehicle.shape == (HEIGHT, WIDTH, 3)
    middle = np.s_[HEIGHT // 3 : -HEIGHT // 8, WIDTH // 3 : -WIDTH // 3]
    assert (np.abs(with_vehicle[middle].astype(int) - lower[middle]).max(axis=2) > 40).sum() > 100
    inset = with_vehicle[MARGIN : MARGIN + INSET, -MARGIN - INSET : -MARGIN]
    assert np.ptp(inset.reshape(-1, 3), axis=0).max() > 50


def test_pictures_made_on_several_cores_come_in_their_order(world):
    recording = hovering(0.8)
    recording.rows["pos_ned"][:, 2] -= np.linspace(0.0, 30.0, len(recording))  # it climbs out of the owner's sight
    images = [image[:-40, : -INSET - 2 * MARGIN].astype(int) for image in film(recording, world)]
    assert len(images) == len(recording) // 2
    steps = [np.abs(b - a).mean() for a, b in pairwise(images)]
    assert max(steps) < np.abs(images[-1] - images[0]).mean()
    again = [image[:-40, : -INSET - 2 * MARGIN].astype(int) for image in film(recording, world)]
    assert all((a == b).all() for a, b in zip(images, again, strict=True))


def test_a_film_is_large_and_who_stops_taking_pictures_is_not_waited_for(world):
    images = film(hovering(1.0), world)
    assert next(images).shape[0] >= 540
    assert next(images).shape[1] >= 960
    images.close()


def test_the_caption_tells_clock_mode_and_distance_or_speed_and_height():
    rows = hovering().rows
    rows["time_s"] += 60.0
    assert caption(Moment(rows[0])) == "1:10.0   Offboard   2.0 m to the owner"
    rows["owner"]["stature_m"] = 0.0
    rows["vel_ned"] = (3.0, 4.0, 0.0)
    assert caption(Moment(rows[0])) == "1:10.0   Offboard   5.0 m/s   1.4 m high"


def test_the_clock_does_not_show_sixty_seconds():
    rows = hovering().rows
    rows["time_s"] = 119.98
    assert caption(Moment(rows[0])).startswith("1:59.9 ")


def test_what_is_told_has_a_total_and_names_the_file_also_without_a_terminal(world, tmp_path, monkeypatch):
    monkeypatch.setattr(film_file, "LINE_PERIOD_S", 0.0)
    out = io.StringIO()
    target = tmp_path / "with a name that is long enough to be wrapped at eighty columns of a terminal.mp4"
    write_film(hovering(0.4), world, target, Console(file=out, width=80))
    lines = out.getvalue().splitlines()
    assert lines[0].startswith("film: picture 1 of 10, ")
    assert lines[-1] == f"film of 0 s: {target}"
    with av.open(str(target)) as written:
        assert sum(1 for _ in written.decode(video=0)) == 10


def test_a_terminal_gets_a_bar_with_the_total(world, tmp_path):
    out = io.StringIO()
    write_film(hovering(0.4), world, tmp_path / "a.mp4", Console(file=out, width=80, force_terminal=True))
    assert "10/10" in out.getvalue()


def test_of_what_drives_no_height_is_told_and_its_mode_has_its_classs_title():
    recording = hovering(1.0, mode=Mode.POSITION)
    config = recording.config.model_copy(update={"airframe": "rover", "owner": None})
    driven = dataclasses.replace(recording, config=config)
    driven.rows["owner"] = np.zeros(1, driven.rows["owner"].dtype)
    assert caption(driven.moment(0), drives=True) == "0:10.0   Position   0.0 m/s"
    assert "Land" not in driven.modes.values()
    assert "Land" in recording.modes.values()
