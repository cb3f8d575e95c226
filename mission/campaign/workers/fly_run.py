"""Flies one run of a campaign; what workers do, wherever they are."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mission.campaign.campaign import Campaign
from mission.campaign.runs import Order, Record, lost, record_of
from mission.campaign.varying import KeyFault, varied
from mission.console.option_checks import UserError
from mission.scenario.flight.building import load_scenario_kernels
from mission.scenario.runner import run_scenario


@dataclass(frozen=True, slots=True)
class CampaignRuns:
    """Runs of a campaign, as worker processes do them."""

    campaign: Campaign
    logs: Path | None = None
    """Where each run has a folder with its logs; runs of a batch have none. None: no run has."""

    def prepare(self, orders: Sequence[Order]) -> None:
        """Loads the kernels, which are the same for all of a batch."""
        with suppress(KeyFault):
            load_scenario_kernels(varied(self.campaign.flown, orders[0].values))

    def outcomes(self, orders: Sequence[Order]) -> list[Record]:
        """The records of runs: one by itself, several in a batch."""
        if len(orders) == 1:
            order = orders[0]
            return [fly_run(self.campaign, order, None if self.logs is None else self.logs / order.folder)]
        from mission.campaign.batch.fly_batch import fly_batch

        return fly_batch(self.campaign, orders)

    def lost(self, order: Order, reason: str) -> Record:
        return lost(order, reason)


def fly_run(campaign: Campaign, order: Order, folder: Path | None = None) -> Record:
    """The record of one run, with its logs in a folder; what cannot be flown with its values is a finding, too."""
    scenario = campaign.flown
    try:
        result = run_scenario(varied(scenario, order.values), order.seed, folder=folder)
    except (UserError, KeyFault) as error:
        return lost(order, f"cannot be flown: {error}")
    except Exception as error:
        return lost(order, f"{type(error).__name__}: {error}")
    return record_of(order, result, campaign.margin)
