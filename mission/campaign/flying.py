"""A campaign under way: its samples and searches flown, each run once, kept as it is done.

In: a campaign, workers, a store. Out: the records of each phase. What the store holds already is not flown again, so a
campaign that was interrupted goes on where it was: the searches choose the same runs by the same results.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

from mission.campaign.campaign import Campaign
from mission.campaign.run_store import RunStore
from mission.campaign.runs import Order, Record
from mission.console.option_checks import UserError

Note = Callable[[Record], None]
"""Called with each run that is flown."""


class Stopped(Exception):
    """Nobody is left to fly; the message says why. What was flown is kept."""


class Workers(Protocol):
    """Who flies runs."""

    def fly(self, orders: Sequence[Order]) -> Iterator[Record]: ...

    def close(self) -> None: ...


class Flights:
    """Runs of one campaign.

    Args:
        campaign: with its scenario read.
        store: where they are kept.
        workers: who flies them.
        note: told of each that is flown.
    """

    def __init__(self, campaign: Campaign, store: RunStore, workers: Workers, note: Note) -> None:
        self.campaign = campaign
        self._store, self._workers, self._note = store, workers, note
        self.flown_count = 0

    def fly(self, orders: Sequence[Order]) -> list[Record]:
        """The record of each order, in their order; what is kept already is not flown.

        Raises:
            UserError: what is kept is of other values.
        """
        for order in orders:
            kept = self._store.records.get(order.key)
            if kept is not None and kept.order != order:
                where = f"{self._store.path}: run {order.number} of {order.phase}"
                raise UserError(f"{where} was flown with other values, by another version: name another --folder")
        missing = [order for order in orders if order.key not in self._store.records]
        for record in self._workers.fly(missing):
            self._store.add(record)
            self.flown_count += 1
            self._note(record)
        return [self._store.records[order.key] for order in orders]
