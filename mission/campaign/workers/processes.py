"""Runs flown in processes of this machine. One that ends or hangs takes its run with it, not the campaign.

In: orders. Out: records, in the order in which they are done. A process has one run at a time, or a batch.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

from common.worker_processes import WorkerProcesses
from mission.campaign.campaign import Campaign
from mission.campaign.runs import Order, Record
from mission.campaign.workers.fly_run import CampaignRuns


class Processes:
    """Processes that fly runs.

    Args:
        campaign: whose.
        jobs: how many at a time.
        run_max_s: a run that takes longer by the wall clock hangs, and is given up.
        batch: how many runs a process flies in a launch of the kernels; 1: each by itself, over MAVLink.
        logs: where each run has a folder with its logs; None: no run has.
    """

    def __init__(
        self, campaign: Campaign, jobs: int, run_max_s: float, batch: int = 1, logs: Path | None = None
    ) -> None:
        self._processes = WorkerProcesses[Order, Record](CampaignRuns(campaign, logs), jobs, run_max_s, batch)

    def fly(self, orders: Sequence[Order]) -> Iterator[Record]:
        """The record of each order, as they come."""
        for _, record in self._processes.done(orders):
            yield record

    def close(self) -> None:
        """Ends all processes, whatever they do."""
        self._processes.close()
