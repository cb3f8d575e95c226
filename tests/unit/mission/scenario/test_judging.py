"""Checks of flights that were made up: what is compared is of one time, and only of those asked for."""

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest

from mission.log.flight_recorder import HISTORY, History
from mission.scenario.judging.motion_checks import separation
from mission.scenario.judging.seen import NothingToJudge, Seen
from mission.scenario.parts.checks import Check

FRAME_US = 20_000


def history(times_us, north_m, *, is_armed=True):
    rows = np.zeros(len(times_us), HISTORY)
    rows["time_us"], rows["is_armed"] = times_us, is_armed
    rows["pos_ned_true"][:, 0] = north_m
    return History(*(rows[each.name] for each in fields(History)))


def fleet(*histories):
    run = SimpleNamespace(marks={})
    found = [Seen(run, SimpleNamespace(number=k), each, 1e9) for k, each in enumerate(histories, 1)]
    for seen in found:
        seen.others = found
    return found


def judged(seen, **keys):
    check = Check.model_validate({"separation": 5.0, **keys})
    (result,) = separation(seen[0], check, check.separation)
    return result


def test_a_separation_compares_what_was_at_one_time():
    """Of who stands for minutes few frames are kept."""
    all_us = np.arange(1, 10_001) * FRAME_US
    thinned_us = np.concatenate([all_us[:100], all_us[100:9000:50], all_us[9000:]])
    leaves = history(all_us, np.linspace(0.0, 1000.0, len(all_us)))
    follows = history(thinned_us, np.interp(thinned_us, all_us, leaves.pos_ned_true[:, 0]) - 20.0)
    assert judged(fleet(leaves, follows)).margin == pytest.approx(15.0, abs=0.01)


def test_a_separation_may_be_of_one_vehicle_from_the_others():
    times_us = np.arange(1, 101) * FRAME_US
    seen = fleet(*(history(times_us, north_m) for north_m in (0.0, 3.0, 13.0)))
    assert judged(seen).margin == pytest.approx(-2.0)
    assert judged(seen, vehicle=3).margin == pytest.approx(5.0)


def test_who_was_never_armed_together_is_not_judged():
    times_us = np.arange(1, 101) * FRAME_US
    seen = fleet(history(times_us, 0.0), history(times_us, 3.0, is_armed=False))
    with pytest.raises(NothingToJudge, match="no two were armed together"):
        judged(seen)
