"""Which runs a campaign has: values and seeds of each, drawn from its distributions.

Run k is drawn from a random stream of its own, keyed by the campaign's seed, its phase and k: the same whoever flies
it, in whichever order, and however often the campaign was interrupted.
"""

import zlib
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from mission.campaign.campaign import SEED_KEY, SEED_MAX, Campaign
from mission.campaign.distributions import STANDARD, Value
from mission.campaign.runs import SAMPLE, Order

Rows = npt.NDArray[np.float64]
Z_MAX = 8.0  # beyond it a quantile is 0 or 1 in double precision


def stream(campaign: Campaign, phase: str, number: int) -> np.random.Generator:
    """The random numbers of one run."""
    return np.random.default_rng([campaign.seed, zlib.crc32(phase.encode()), number])


def sample_orders(campaign: Campaign, count: int) -> list[Order]:
    """The runs that are samples of all keys."""
    return [sample_order(campaign, SAMPLE, number) for number in range(count)]


def sample_order(campaign: Campaign, phase: str, number: int) -> Order:
    """One run of all keys."""
    return order_at(campaign, phase, number, draw(campaign, phase, number))


def draw(campaign: Campaign, phase: str, number: int) -> Rows:
    """The standard normal numbers of a run, one for each key."""
    return stream(campaign, phase, number).standard_normal(len(campaign.vary))


def order_at(campaign: Campaign, phase: str, number: int, z: Rows, weight: float = 1.0) -> Order:
    """The run whose values are at standard normal numbers, one for each key."""
    values = values_at(campaign, list(campaign.vary), z)
    own = stream(campaign, f"{phase} flight", number).integers(0, SEED_MAX)
    return Order(phase, number, int(values.get(SEED_KEY, own)), values, weight)


def values_at(campaign: Campaign, keys: Sequence[str], z: Rows) -> dict[str, Value]:
    """The values of keys at standard normal numbers."""
    inside = np.clip(z, -Z_MAX, Z_MAX)
    return {key: campaign.vary[key].quantile(STANDARD.cdf(float(at))) for key, at in zip(keys, inside, strict=True)}
