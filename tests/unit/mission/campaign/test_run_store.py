"""Runs on the disk: nothing is lost, a torn line is cut off, other campaigns are refused."""

import pytest

from mission.campaign.run_store import RUNS_FILE, RunStore
from mission.campaign.runs import Record
from mission.console.option_checks import UserError


def record(number):
    return Record("sample", number, 7, {"wind.speed_m_s": 0.1 + number}, 1.0, passed=True, margin=1.5, failures=("x",))


def test_what_was_added_is_there_to_the_bit(tmp_path):
    with RunStore(tmp_path, {"name": "a"}) as store:
        store.add(record(0))
        store.add(record(1))
    with RunStore(tmp_path, {"name": "a"}) as store:
        assert list(store.records.values()) == [record(0), record(1)]


def test_a_torn_last_line_is_cut_off(tmp_path):
    with RunStore(tmp_path, {}) as store:
        store.add(record(0))
        store.add(record(1))
    path = tmp_path / RUNS_FILE
    path.write_bytes(path.read_bytes()[:-9])
    with RunStore(tmp_path, {}) as store:
        assert list(store.records) == [("sample", 0)]
        store.add(record(1))
    with RunStore(tmp_path, {}) as store:
        assert len(store.records) == 2


def test_a_wrong_line_is_named(tmp_path):
    with RunStore(tmp_path, {}) as store:
        store.add(record(0))
    (tmp_path / RUNS_FILE).write_bytes(b'{"a": 1}\n' + (tmp_path / RUNS_FILE).read_bytes())
    with pytest.raises(UserError, match=r"runs.jsonl:1: is no run of a campaign"):
        RunStore(tmp_path, {})


def test_another_campaign_and_a_second_process_are_refused(tmp_path):
    with RunStore(tmp_path, {"name": "a"}), pytest.raises(UserError, match="another campaign is writing there"):
        RunStore(tmp_path, {"name": "a"})
    with pytest.raises(UserError, match="holds another campaign"):
        RunStore(tmp_path, {"name": "b"})


def test_there_must_be_something_to_resume(tmp_path):
    with pytest.raises(UserError, match="holds no campaign to resume"):
        RunStore(tmp_path / "new", {}, must_exist=True)
    assert not (tmp_path / "new").exists()
