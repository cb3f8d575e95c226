"""Plan files: what is read, what is written, and the sentence each wrong file gets."""

import copy
import json
from dataclasses import replace
from math import isnan, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavwp

from common.geodesy import GeoPoint, ned_from_geodetic
from mission.plan.plan_file import (
    DEFAULT_PLAN,
    FenceCircle,
    FencePolygon,
    Plan,
    PlanError,
    PlanItem,
    moved_plan,
    parse_plan,
    plan_text,
    read_plan,
    save_plan,
)
from mission.plan.waypoints import waypoints_text

HOME = GeoPoint(47.397742, 8.545594, 488.0)
TAKEOFF, WAYPOINT, LAND, DO_JUMP = 22, 16, 21, 177


def simple_item(jump_id, command=WAYPOINT, params=(0, 0, 0, None, 47.398, 8.546, 20), frame=3):
    return {
        "autoContinue": True,
        "command": command,
        "doJumpId": jump_id,
        "frame": frame,
        "params": list(params),
        "type": "SimpleItem",
    }


def survey(jump_ids):
    return {
        "type": "ComplexItem",
        "complexItemType": "survey",
        "version": 5,
        "angle": 30,
        "polygon": [[47.39, 8.54], [47.40, 8.54], [47.40, 8.55]],
        "TransectStyleComplexItem": {"version": 2, "Items": [simple_item(k) for k in jump_ids]},
    }


def document(items=None, **changes):
    mission = {
        "version": 2,
        "firmwareType": 12,
        "vehicleType": 2,
        "cruiseSpeed": 15,
        "hoverSpeed": 6,
        "plannedHomePosition": [HOME.lat_deg, HOME.lon_deg, HOME.alt_m],
        "items": [simple_item(1, TAKEOFF), simple_item(2)] if items is None else items,
    }
    return {"fileType": "Plan", "version": 1, "groundStation": "QGroundControl", "mission": mission} | changes


def parse(raw):
    return parse_plan(json.dumps(raw), "mission.plan")


def with_item(**changes):
    return document([simple_item(1, TAKEOFF), simple_item(2), simple_item(3) | changes])


def test_items_are_read_as_they_are_uploaded():
    plan = parse(document())
    assert [item.seq for item in plan.items] == [0, 1]
    item = plan.items[1]
    assert (item.frame, item.command, item.autocontinue) == (3, WAYPOINT, True)
    assert item.params[:3] == (0.0, 0.0, 0.0)
    assert isnan(item.params[3])
    assert (item.x, item.y, item.z) == (47.398, 8.546, 20.0)
    assert plan.home == HOME
    assert plan.hover_speed_m_s == 6.0


def test_a_survey_is_flattened_and_jumps_follow():
    jump = simple_item(5, DO_JUMP, (4, 2, 0, 0, 0, 0, 0), frame=2)
    plan = parse(document([simple_item(1, TAKEOFF), survey([2, 3]), simple_item(4), jump]))
    assert [item.command for item in plan.items] == [TAKEOFF, WAYPOINT, WAYPOINT, WAYPOINT, DO_JUMP]
    assert plan.items[4].params[:2] == (3.0, 2.0)


def test_a_survey_is_kept_on_a_round_trip():
    plan = parse(document([simple_item(1, TAKEOFF), survey([2, 3]), simple_item(4)]))
    written = json.loads(plan_text(plan))["mission"]["items"]
    assert written[1] == survey([2, 3])
    assert parse_plan(plan_text(plan), "again") == plan


def test_fence_and_rally_points_are_read():
    fence = {
        "version": 2,
        "circles": [{"version": 1, "inclusion": False, "circle": {"center": [47.39, 8.54], "radius": 30.5}}],
        "polygons": [{"version": 1, "inclusion": True, "polygon": [[47.3, 8.5], [47.4, 8.5], [47.4, 8.6]]}],
    }
    plan = parse(document(geoFence=fence, rallyPoints={"version": 2, "points": [[47.39, 8.55, 25]]}))
    assert plan.fence == (
        FenceCircle(47.39, 8.54, 30.5, is_inclusion=False),
        FencePolygon(((47.3, 8.5), (47.4, 8.5), (47.4, 8.6)), is_inclusion=True),
    )
    assert plan.rally == (GeoPoint(47.39, 8.55, 25.0),)
    assert parse_plan(plan_text(plan), "again") == plan


NO_JUMP = {"command": DO_JUMP, "params": [9, 1, 0, 0, 0, 0, 0], "frame": 2}
CIRCLE = {"inclusion": True, "circle": {"center": [47.39, 8.54], "radius": -1}}
POLYGON = {"inclusion": True, "polygon": [[47.3, 8.5], [47.4, 8.5]]}


@pytest.mark.parametrize(
    ("raw", "sentence"),
    [
        (with_item(params=[0, 0, 0]), "mission.plan: item 3: params must be 7 numbers or null"),
        (with_item(params=[0, 0, 0, "x", 1, 2, 3]), "mission.plan: item 3: params must be 7 numbers or null"),
        (with_item(params=[True, 0, 0, 0, 1, 2, 3]), "mission.plan: item 3: params must be 7 numbers or null"),
        (with_item(params=[0, 0, 0, 0, 91, 2, 3]), "item 3: params: latitude 91 is not within ±90 degrees"),
        (with_item(params=[0, 0, 0, 0, 47, -180.5, 3]), "item 3: params: longitude -180.5 is not within ±180"),
        (with_item(params=[0, 0, 0, 0, 47, 8, None]), "item 3: command 16 needs its altitude"),
        (with_item(frame=9), "item 3: frame 9 is not one of"),
        (with_item(frame=None), "item 3: frame must be a whole number"),
        (with_item(command=70000), "item 3: command must be a whole number from 0 to 65535"),
        (with_item(command=5001), "item 3: command 5001 belongs to a fence or rally file"),
        (with_item(autoContinue=1), "item 3: autoContinue must be true or false"),
        (with_item(doJumpId="2"), "item 3: doJumpId must be a whole number"),
        (with_item(type="Item"), "item 3: type must be SimpleItem or ComplexItem"),
        (
            with_item(type="ComplexItem", complexItemType="StructureScan"),
            "item 3: a complex item of type StructureScan",
        ),
        (with_item(**NO_JUMP), "item 3: jumps to doJumpId 9, which no item has"),
        (document([survey([1]), 7]), "item 2: type must be"),
        (document([{**survey([]), "TransectStyleComplexItem": {"Items": [3]}}]), "item 1: stored item 1: must be an"),
        (document([]), "mission.plan: the mission has no items"),
        (document({}), 'mission.plan: mission: "items" is missing or not a list'),
        (document(mission=[]), 'mission.plan: "mission" is missing or not an object'),
        (document(mission={"version": 1}), "mission.plan: mission: version must be 2, not 1"),
        (document(version=2), "mission.plan: version must be 1, not 2"),
        (document(fileType="Params"), "mission.plan: is neither a QGroundControl plan"),
        ([1, 2], "mission.plan: is neither a QGroundControl plan"),
        (document(geoFence={"version": 1}), "geoFence: version must be 2"),
        (document(geoFence={"version": 2, "circles": [CIRCLE]}), "geoFence: circle 1: radius must be positive"),
        (
            document(geoFence={"version": 2, "circles": [], "polygons": [POLYGON]}),
            "polygon 1: a polygon needs at least 3",
        ),
        (document(rallyPoints={"version": 2, "points": [[1, 2]]}), "point 1 must be latitude, longitude and altitude"),
    ],
)
def test_a_wrong_plan_gets_one_sentence_with_the_place(raw, sentence):
    with pytest.raises(PlanError) as error:
        parse(raw)
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, '{"a": NaN}', '{"a": ' + "9" * 10_000 + "}", "hello", "null"])
def test_text_that_is_no_plan_gets_one_sentence(text):
    with pytest.raises(PlanError, match=r"^x\.plan: "):
        parse_plan(text, "x.plan")


def test_numbers_beyond_float32_are_refused():
    text = json.dumps(with_item(params=[0, 0, 0, 0, 47, 8, 12345])).replace("12345", "1e999")
    with pytest.raises(PlanError, match="item 3: params must be 7 numbers"):
        parse_plan(text, "mission.plan")


@settings(max_examples=60)
@given(st.data())
def test_a_truncated_plan_gets_a_plan_error(data):
    text = plan_text(read_plan(DEFAULT_PLAN)).strip()
    with pytest.raises(PlanError):
        parse_plan(text[: data.draw(st.integers(0, len(text) - 1))], "x.plan")


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=7) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=10,
)


@settings(max_examples=150)
@given(st.data(), json_values)
def test_a_value_of_any_kind_anywhere_is_read_or_gets_a_plan_error(data, value):
    whole = document(
        [simple_item(1), survey([2]), simple_item(3)],
        geoFence={"version": 2, "circles": [CIRCLE], "polygons": [POLYGON]},
        rallyPoints={"version": 2, "points": [[1, 2, 3]]},
    )
    raw = node = copy.deepcopy(whole)  # the next example begins with the same
    while True:
        key = (
            data.draw(st.sampled_from(sorted(node)))
            if isinstance(node, dict)
            else data.draw(st.integers(0, len(node) - 1))
        )
        if not isinstance(node[key], dict | list) or not node[key] or data.draw(st.booleans()):
            node[key] = value
            break
        node = node[key]
    try:
        text = json.dumps(raw, allow_nan=False)
    except ValueError:
        return
    try:
        assert parse_plan(text, "x.plan").items
    except PlanError as error:
        assert str(error).startswith("x.plan: ")


angles = st.floats(allow_nan=False, allow_infinity=False, width=32)
numbers = st.one_of(st.just(nan), angles)
plan_items = st.builds(
    PlanItem,
    seq=st.just(0),
    frame=st.sampled_from([0, 3, 10]),
    command=st.sampled_from([WAYPOINT, TAKEOFF, LAND, 17, 19]),
    params=st.tuples(numbers, numbers, numbers, numbers),
    x=st.floats(-90, 90),
    y=st.floats(-180, 180),
    z=st.floats(-500, 9_000),
    autocontinue=st.booleans(),
)
plans = st.builds(
    lambda items, home: Plan(tuple(replace(item, seq=k) for k, item in enumerate(items)), home),
    st.lists(plan_items, min_size=1, max_size=5),
    st.one_of(st.none(), st.builds(GeoPoint, st.floats(1, 90), st.floats(-180, 180), st.floats(-500, 9_000))),
)


@settings(max_examples=50)
@given(plans)
def test_both_formats_keep_every_number(plan):
    assert repr(parse_plan(plan_text(plan), "p")) == repr(plan)
    again = parse_plan(waypoints_text(plan.home, plan.items), "w")
    assert (repr(again.items), again.home) == (repr(plan.items), plan.home)


def waypoint_lines(*rows):
    return "QGC WPL 110\n" + "".join("\t".join(map(str, row)) + "\n" for row in rows)


HOME_ROW = (0, 1, 0, 16, 0, 0, 0, 0, 47.397742, 8.545594, 488, 1)


def row(number, **changes):
    values = {"seq": number, "current": 0, "frame": 3, "command": 16} | {f"p{k}": 0 for k in range(1, 5)}
    return tuple((values | {"x": 47.398, "y": 8.546, "z": 20, "autocontinue": 1} | changes).values())


def test_waypoint_files_give_home_and_items():
    plan = parse_plan(
        waypoint_lines(HOME_ROW, row(1, command=22), row(2), row(3, command=DO_JUMP, p1=2)), "a.waypoints"
    )
    assert plan.home == HOME
    assert [item.seq for item in plan.items] == [0, 1, 2]
    assert plan.items[2].params[0] == 1.0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("QGC WPL 120\n", "a.txt: the first line must be QGC WPL 110, not QGC WPL 120"),
        (waypoint_lines(HOME_ROW), "a.txt: the mission has no items after the home"),
        (waypoint_lines(HOME_ROW, row(1)[:9]), "item 1 (line 3): a line must have 12 columns, not 9"),
        (waypoint_lines(HOME_ROW, row(2)), "item 1 (line 3): items must be numbered 0, 1, 2 and so on, not 2"),
        (waypoint_lines(HOME_ROW, row(1, z="high")), "item 1 (line 3): z must be a number, not high"),
        (waypoint_lines(HOME_ROW, row(1, z="inf")), "item 1 (line 3): z must be finite"),
        (waypoint_lines(HOME_ROW, row(1, frame="x")), "item 1 (line 3): number, frame, command and autocontinue"),
        (waypoint_lines(HOME_ROW, row(1, x=99)), "item 1 (line 3): params: latitude 99"),
        (waypoint_lines(HOME_ROW, row(1, command=5003)), "item 1 (line 3): command 5003 belongs to a fence"),
        (waypoint_lines(HOME_ROW, row(1, command=DO_JUMP, p1=5)), "item 1: jumps to item 5, which does not exist"),
    ],
)
def test_a_wrong_waypoint_file_gets_one_sentence_with_the_place(text, sentence):
    with pytest.raises(PlanError) as error:
        parse_plan(text, "a.txt")
    assert sentence in str(error.value)


def test_pymavlink_reads_the_waypoint_file_we_write(tmp_path):
    path = tmp_path / "default.waypoints"
    plan = read_plan(DEFAULT_PLAN)
    save_plan(path, plan)
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(path)) == len(plan.items) + 1
    for item in plan.items:
        read = loader.wp(item.seq + 1)
        assert (read.command, read.frame) == (item.command, item.frame)
        assert (read.x, read.y, read.z) == pytest.approx((item.x, item.y, item.z))


def test_missing_and_unreadable_files_get_one_sentence(tmp_path):
    binary = tmp_path / "a.plan"
    binary.write_bytes(b"\xff\xfe\x00")
    for path, reason in (
        (tmp_path / "no.plan", "No such file"),
        (tmp_path, "Is a directory"),
        (binary, "not a text file"),
    ):
        with pytest.raises(PlanError, match=reason):
            read_plan(path)


def test_the_default_plan_flies_a_loop_and_lands_at_home():
    plan = read_plan(DEFAULT_PLAN)
    assert plan.home == HOME
    first, *middle, last = plan.items
    assert (first.command, last.command) == (TAKEOFF, LAND)
    assert all(item.command == WAYPOINT and item.frame == 3 for item in middle)
    assert ned_from_geodetic(last.x, last.y, HOME.alt_m, HOME)[:2] == pytest.approx((0.0, 0.0), abs=1e-3)
    reach_m = [ned_from_geodetic(item.x, item.y, HOME.alt_m, HOME)[:2] for item in middle]
    assert 50.0 < max(north for north, _ in reach_m) - min(north for north, _ in reach_m) < 100.0
    assert all(item.z >= 12.0 for item in middle)


def test_moved_plan_keeps_its_shape_and_heights_above_home():
    plan = read_plan(DEFAULT_PLAN)
    home = GeoPoint(-33.86, 151.2, 20.0)
    moved = moved_plan(plan, home)
    assert moved.home == home
    for old, new in zip(plan.items, moved.items, strict=True):
        assert (new.seq, new.command, new.frame, new.z) == (old.seq, old.command, old.frame, old.z)
        there = ned_from_geodetic(old.x, old.y, plan.home.alt_m, plan.home)
        here = ned_from_geodetic(new.x, new.y, home.alt_m, home)
        assert here[:2] == pytest.approx(there[:2], abs=0.01)
