"""Collecting in shards: one dataset, whoever collected what and however often it was interrupted."""

import json

import pytest

from mission.dataset.collect_shard import collect_into
from mission.dataset.shards import ShardOrder, collect_shards, shard_orders
from policies.datasets.episodes import DatasetError
from policies.datasets.reader import DatasetReader

WHOLE = ShardOrder(0, "RollerBall", "random", 10, 0.0, 5, ())


class Here:
    """Collects in this process, in some order, and is gone after so many shards."""

    def __init__(self, *, is_reversed=False, most=100):
        self.is_reversed, self.most, self.collected = is_reversed, most, []

    def collect(self, orders, folder):
        for order in reversed(orders) if self.is_reversed else orders:
            if len(self.collected) == self.most:
                raise DatasetError("gone")
            collect_into(order, folder)
            self.collected.append(order.number)
            yield order


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_shards_make_the_same_bytes_in_any_order_and_after_an_interruption(tmp_path):
    told = []
    assert collect_shards(WHOLE, 3, tmp_path / "once", Here(), told.append) == 10
    assert told == [0, 4, 7, 10]
    first, then = Here(is_reversed=True, most=1), Here(is_reversed=True)
    with pytest.raises(DatasetError, match="gone"):
        collect_shards(WHOLE, 3, tmp_path / "twice", first, told.append)
    assert not (tmp_path / "twice").exists()
    (tmp_path / "twice.shards" / "shard-0001.part").mkdir()  # as a killed process leaves it
    collect_shards(WHOLE, 3, tmp_path / "twice", then, told.append)
    assert (first.collected, then.collected) == ([2], [1, 0])
    assert content(tmp_path / "once") == content(tmp_path / "twice")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["once", "twice"]
    with DatasetReader(tmp_path / "once") as reader:
        assert (reader.count, reader.origin.seed, reader.origin.pilot) == (10, 5, "random")


def test_shards_have_seeds_of_their_own():
    orders = shard_orders(WHOLE, 4)
    assert [order.episodes for order in orders] == [3, 3, 2, 2]
    assert len({order.seed for order in orders}) == 4
    with pytest.raises(DatasetError, match=r"--shards 11: at most 10 for 10 episodes"):
        shard_orders(WHOLE, 11)


def test_shards_of_another_collection_are_refused(tmp_path):
    folder = tmp_path / "out.shards"
    folder.mkdir()
    (folder / "order.json").write_text(json.dumps({"number": 0, "task": "Hover"}))
    with pytest.raises(DatasetError, match=r"out.shards: holds shards of another collection: task is Hover there"):
        collect_shards(WHOLE, 2, tmp_path / "out", Here(), lambda _: None)
    (folder / "order.json").write_text("{")
    with pytest.raises(DatasetError, match=r"order.json: is damaged; remove"):
        collect_shards(WHOLE, 2, tmp_path / "out", Here(), lambda _: None)
    assert not (tmp_path / "out").exists()


def test_nothing_is_left_where_no_shard_was_finished(tmp_path):
    with pytest.raises(DatasetError, match="gone"):
        collect_shards(WHOLE, 2, tmp_path / "out", Here(most=0), lambda _: None)
    assert not list(tmp_path.iterdir())
