"""What can be seen to be wrong with a campaign before it is flown: airframes, parameters, plans, worlds."""

from mission.campaign.campaign import SEED_KEY, Campaign
from mission.campaign.varying import varied
from mission.scenario.flight.building import check_scenario


def check_campaign(campaign: Campaign, file: str) -> None:
    """Builds the configurations of the scenario, and of each key at its bounds.

    Raises:
        UserError: one cannot be flown.
    """
    scenario = campaign.flown
    check_scenario(scenario, file)
    for key, distribution in campaign.vary.items():
        if key != SEED_KEY:
            for value in distribution.values:
                check_scenario(varied(scenario, {key: value}), f"{file}: vary.{key}: {value}")
