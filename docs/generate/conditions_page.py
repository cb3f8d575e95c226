"""The text of docs/reference/follow-conditions.md, made from the conditions of the benchmark of following."""

from mission.follow.benchmark.conditions import AIRFRAME, CONDITIONS, LEAST_KEPT, LEAST_RESUMED, LEAST_STOOD, Condition
from mission.follow.benchmark.flights import BACK_S, HOLD_S, TREES_PER_HA, WINDS_M_S
from policies.tasks.follow_me.track import Ranges

_HEADER = """\
# Conditions of the benchmark of following

Written by `python -m docs.generate` from the code: do not edit.

What [`honeyguide benchmark follow`](../how-to/follow-me.md#harder-conditions) flies, and what it wants; what came of
it: [results/harder.md](../results/harder.md). Numbers are FollowMe's ([meanings and defaults](tasks.md#followme));
those that are not named are at their defaults. Where nothing else is said, {trees} trees grow on a hectare, the
wind is of {winds} m/s, by the seed, and an {airframe} flies. Pictures that freeze: none comes for 0.4 to 1.2 s.

Wanted of any condition, besides what its row says:

- No flight touches somebody or something.
- {kept:.0%} of the flights keep the owner: flown to the end, and never out of the band for over {back_s:g} s while they
  could be seen. The band is {near_m:g} to {far_m:g} m from their chest.
- Of the flights that can show it, {stood:.0%} stand {hold_s:g} s after the last sight, and {resumed:.0%} are in the
  band again within {back_s:g} s of a return.

| condition | name | owner | differs by | wanted |
|---|---|---|---|---|
"""


def conditions_text() -> str:
    """The whole page."""
    ranges = Ranges()
    header = _HEADER.format(
        trees=_listed(TREES_PER_HA), winds=_listed(WINDS_M_S), kept=LEAST_KEPT, back_s=BACK_S, stood=LEAST_STOOD,
        hold_s=HOLD_S, airframe=AIRFRAME, resumed=LEAST_RESUMED, near_m=ranges.near_m, far_m=ranges.far_m,
    )  # fmt: skip
    return header + "".join(_row(condition) for condition in CONDITIONS)


def _row(condition: Condition) -> str:
    owner = {"walk": "walks", "run": "runs"}[condition.pace]
    cells = (condition.title, f"`{condition.name}`", owner, _differences(condition), _wanted(condition))
    return f"| {' | '.join(cells)} |\n"


def _differences(condition: Condition) -> str:
    parts = [f"`{name}` {value:g}" for name, value in condition.numbers.items()]
    if condition.wind_m_s is not None:
        parts.append(f"wind of {condition.wind_m_s:g} m/s")
    if condition.sensor_roughness:
        parts.append(f"`sensor_roughness` {condition.sensor_roughness:g}")
    if condition.airframe != AIRFRAME:
        parts.append(f"airframe `{condition.airframe}`")
    if condition.gnss_away_s is not None:
        parts.append("no GNSS from {:g} to {:g} s".format(*condition.gnss_away_s))
    return ", ".join(parts) or "-"


def _wanted(condition: Condition) -> str:
    parts = []
    if condition.least_in_band is not None:
        parts.append(f"in band {condition.least_in_band:.0%}")
    if condition.least_m is not None:
        parts.append(f"never nearer than {condition.least_m:g} m to a hidden owner")
    if condition.most_accel is not None:
        parts.append(f"own level acceleration below {condition.most_accel:g} m/s² RMS")
    if condition.most_yaw_rate is not None:
        parts.append(f"own yaw rate below {condition.most_yaw_rate:g} deg/s RMS")
    return ", ".join(parts) or "-"


def _listed(values: tuple[float, ...]) -> str:
    *first, last = (f"{value:g}" for value in values)
    return f"{', '.join(first)} or {last}"
