"""Flies one run of a campaign; what workers do, wherever they are."""

from collections.abc import Sequence
from pathlib import Path

from mission.campaign.campaign import Campaign
from mission.campaign.runs import Order, Record, lost, record_of
from mission.campaign.varying import KeyFault, varied
from mission.console.option_checks import UserError
from mission.scenario.runner import run_scenario


def fly_chunk(campaign: Campaign, orders: Sequence[Order], logs: Path | None = None) -> list[Record]:
    """The records of runs: one by itself, several in a batch.

    Args:
        campaign: whose.
        orders: what is flown.
        logs: where each run has a folder with its logs; runs of a batch have none. None: no run has.
    """
    if len(orders) == 1:
        order = orders[0]
        return [fly_run(campaign, order, None if logs is None else logs / order.folder)]
    from mission.campaign.batch.fly_batch import fly_batch

    return fly_batch(campaign, orders)


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
