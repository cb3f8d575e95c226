"""Flies one run of a campaign; what workers do, wherever they are."""

from collections.abc import Sequence

from mission.campaign.campaign import Campaign
from mission.campaign.runs import Order, Record, lost, record_of
from mission.campaign.varying import KeyFault, varied
from mission.console.option_checks import UserError
from mission.scenario.runner import run_scenario


def fly_chunk(campaign: Campaign, orders: Sequence[Order]) -> list[Record]:
    """The records of runs: one by itself, several in a batch."""
    if len(orders) == 1:
        return [fly_run(campaign, orders[0])]
    from mission.campaign.batch.fly_batch import fly_batch

    return fly_batch(campaign, orders)


def fly_run(campaign: Campaign, order: Order) -> Record:
    """The record of one run; what cannot be flown with its values is a finding, too."""
    scenario = campaign.flown
    try:
        result = run_scenario(varied(scenario, order.values), order.seed)
    except (UserError, KeyFault) as error:
        return lost(order, f"cannot be flown: {error}")
    except Exception as error:
        return lost(order, f"{type(error).__name__}: {error}")
    return record_of(order, result, campaign.margin)
