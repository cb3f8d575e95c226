"""Campaign files: read and checked; each fault is one sentence with file, line and key. Light to import."""

from pathlib import Path

from pydantic import ValidationError

from common.config.refusal import sentence
from common.config.yaml_locations import ConfigError, Located, location_at, note_at, read_yaml
from mission.campaign.campaign import SEED_KEY, SEED_MAX, Campaign
from mission.campaign.varying import KeyFault, varied
from mission.console.option_checks import UserError
from mission.scenario.scenario import Scenario
from mission.scenario.scenario_file import read_scenario, scenario_of

SUFFIX = ".campaign.yaml"


def read_campaign(path: Path | str) -> Campaign:
    """The campaign of a file, with its scenario read.

    Raises:
        UserError: it cannot be read, or says something that is wrong.
    """
    path, notes = Path(path), list[str]()
    try:
        root = read_yaml(path, notes)
    except ConfigError as error:
        raise UserError(str(error)) from error
    if notes:
        raise UserError(notes[0])
    if not root.get("name"):
        root.put("name", path.name.removesuffix(SUFFIX).removesuffix(path.suffix))
    campaign = _validated(root)
    scenario = _scenario(root, path)
    _check_margin(campaign, scenario, root)
    _check_keys(campaign, scenario, root)
    return campaign.model_copy(update={"scenario": scenario})


def _validated(root: Located) -> Campaign:
    """The campaign; a scenario written out is looked at later, where its own keys are named in its faults."""
    given = {**root, "scenario": "written-out"} if isinstance(root.get("scenario"), Located) else root
    try:
        return Campaign.model_validate(given)
    except ValidationError as error:
        first = min(error.errors(), key=lambda each: location_at(root, each["loc"])[0].line)
        loc = tuple(part for part in first["loc"] if part not in ("json-or-python[json=str,python=path]", "Scenario"))
        location, key = location_at(root, loc)
        raise UserError(note_at(location, key, sentence(first, Campaign))) from error


def _scenario(root: Located, path: Path) -> Scenario:
    given = root["scenario"]
    if isinstance(given, Located):
        return scenario_of(given, str(root["name"]), path.parent)
    file = path.parent / str(given)
    if not file.is_file():
        raise UserError(note_at(root.location_of("scenario"), "scenario", f"{given}: no such file"))
    return read_scenario(file)


def _check_margin(campaign: Campaign, scenario: Scenario, root: Located) -> None:
    """Refuses a margin that is of no check of the scenario."""
    titles = list(dict.fromkeys(check.title for check in scenario.checks))
    if campaign.margin and campaign.margin not in titles:
        wrong = f"no check is called '{campaign.margin}'; there are {', '.join(titles) or 'none'}"
        raise UserError(note_at(root.location_of("margin"), "margin", wrong))


def _check_keys(campaign: Campaign, scenario: Scenario, root: Located) -> None:
    """Refuses keys that the scenario has not, and distributions that reach beyond what it can have."""
    for key, distribution in campaign.vary.items():
        location, text = location_at(root, ("vary", key))
        if key == SEED_KEY:
            if (
                distribution.integers is None
                or not 0 <= distribution.integers[0] <= distribution.integers[1] <= SEED_MAX
            ):
                raise UserError(note_at(location, text, f"must be integers from 0 to {SEED_MAX}"))
            continue
        try:
            for value in distribution.values:
                varied(scenario, {key: value})
        except KeyFault as error:
            raise UserError(note_at(location, text, str(error))) from error
