"""A whole campaign: its samples, then each of its searches."""

from collections.abc import Callable
from typing import Any

from mission.campaign.flying import Flights
from mission.campaign.runs import Record
from mission.campaign.sampling import sample_orders
from mission.campaign.search.bisection import bisect
from mission.campaign.search.rare_failures import estimate_rare
from mission.campaign.search.worst_case import find_worst


def fly_campaign(flights: Flights, runs: int) -> tuple[list[Record], list[Any]]:
    """The samples, and what each search has found."""
    campaign = flights.campaign
    samples = flights.fly(sample_orders(campaign, runs))
    found = [
        search_of(flights, search, f"{search.name_chosen}-{number}") for number, search in enumerate(campaign.search)
    ]
    return samples, found


def search_of(flights: Flights, search: Any, phase: str) -> Any:
    """What a search has found."""
    kinds: dict[str, Callable[[Flights, Any, str], Any]] = {
        "bisect": bisect,
        "worst": find_worst,
        "rare": estimate_rare,
    }
    return kinds[search.name_chosen](flights, search.chosen, phase)
