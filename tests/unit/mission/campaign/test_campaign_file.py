"""Campaign files: what is wrong is said in one sentence with file, line and key."""

import pytest
import yaml
from jsonschema import Draft202012Validator

from mission.campaign.campaign_file import read_campaign
from mission.campaign.schema import campaign_schema, reference_text
from mission.console.option_checks import UserError
from mission.scenario.scenario import Scenario
from mission.scenario.scenario_file import find_files
from tests.documents import ROOT

SHIPPED = sorted((ROOT / "mission/campaign/ready").glob("*.campaign.yaml"))
CAMPAIGN = """runs: 10
scenario:
  world: {kind: plain}
  wind: {speed_m_s: 2}
  vehicle:
    script: [arm, {takeoff: 5}, land]
  faults:
    - at: 20
      wind: {speed_m_s: 5}
  checks:
    - altitude: {max: 6}
    - at_end: {is_armed: false}
vary:
  wind.speed_m_s: {uniform: [0, 8]}
"""


def refusal(tmp_path, text):
    path = tmp_path / "hop.campaign.yaml"
    path.write_text(text)
    with pytest.raises(UserError) as refused:
        read_campaign(path)
    return str(refused.value).replace(f"{tmp_path}/", "")


def test_a_campaign_has_its_scenario_and_name(tmp_path):
    path = tmp_path / "hop.campaign.yaml"
    path.write_text(CAMPAIGN)
    campaign = read_campaign(path)
    assert campaign.name == "hop"
    assert isinstance(campaign.scenario, Scenario)
    assert campaign.scenario.wind.speed_m_s == 2.0


def test_a_scenario_may_be_a_file_beside_it(tmp_path):
    (tmp_path / "hop.scenario.yaml").write_text("vehicle: {script: [arm]}\n")
    path = tmp_path / "c.yaml"
    path.write_text("scenario: hop.scenario.yaml\nvary: {noise: {uniform: [0, 2]}}\n")
    assert read_campaign(path).scenario.name == "hop"


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("runs: 10", "runz: 10", ":1: runz: unknown key; did you mean runs?"),
        ("{uniform: [0, 8]}", "{uniform: [8, 0]}", ":14: vary.wind.speed_m_s: uniform: the first bound must be"),
        ("{uniform: [0, 8]}", "{unifrom: [0, 8]}", "vary.wind.speed_m_s.unifrom: unknown key; did you mean uniform?"),
        ("{uniform: [0, 8]}", "{loguniform: [0, 8]}", "loguniform: bounds must be above 0, not 0"),
        ("{uniform: [0, 8]}", "{uniform: [0, 80]}", "so: wind.speed_m_s: must be at most 20, not 80"),
        ("wind.speed_m_s: {uni", "wind.sped: {uni", "so: wind.sped: unknown key; did you mean speed_m_s?"),
        ("wind.speed_m_s: {uni", "owner.numbers.lite: {uni", "owner.numbers.lite: unknown key; did you mean light?"),
        ("wind.speed_m_s: {uni", "faults.1.at: {uni", "vary.faults.1.at: faults has no entry 1; there are 0 to 0"),
        ("wind.speed_m_s: {uni", "seed: {uni", "vary.seed: must be integers from 0 to"),
        ("takeoff: 5", "takeof: 5", "hop.campaign.yaml:6: vehicle.script[1]"),
        ("runs: 10", "require: success > 1", "require: must be 'success >= FRACTION', as 'success >= 0.95'"),
        ("runs: 10", "search: {bisect: noise}", "search[0]: 'noise' is not among the varied: wind.speed_m_s"),
        ("runs: 10", "search: {bsect: noise}", "hop.campaign.yaml:1: search"),
        ("runs: 10", "margin: hight", ":1: margin: no check is called 'hight'; there are altitude, at end"),
    ],
)  # fmt: skip
def test_a_fault_is_one_sentence_with_its_place(tmp_path, old, new, sentence):
    assert old in CAMPAIGN
    assert sentence in refusal(tmp_path, CAMPAIGN.replace(old, new))


def test_a_missing_scenario_is_named(tmp_path):
    text = "vary: {noise: {uniform: [0, 2]}}\nscenario: no.yaml\n"
    assert refusal(tmp_path, text) == "hop.campaign.yaml:2: scenario: no.yaml: no such file"


def test_the_schema_has_every_distribution_and_search():
    schema, page = campaign_schema(), reference_text()
    assert schema["title"] == "Honeyguide campaign"
    for name in ("uniform", "normal", "loguniform", "integers", "choice", "bisect", "worst", "rare"):
        assert f"| `{name}` |" in page


def test_campaigns_that_ship_can_be_read():
    found = sorted((ROOT / "mission" / "campaign" / "ready").glob("*.campaign.yaml"))
    assert found
    for path in found:
        assert read_campaign(path).scenario.checks


def test_no_campaign_is_taken_for_a_scenario(tmp_path):
    (tmp_path / "hop.campaign.yaml").write_text(CAMPAIGN)
    with pytest.raises(UserError, match="holds no"):
        find_files([tmp_path])


@pytest.mark.parametrize(
    "path",
    sorted((ROOT / "mission/campaign/ready").glob("*.campaign.yaml")),
    ids=lambda path: path.name.partition(".")[0],
)
def test_the_reference_validator_takes_what_ships_and_refuses_a_wrong_key(path):
    validator = Draft202012Validator(campaign_schema())
    given = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert validator.is_valid(given)
    assert not validator.is_valid({**given, "runz": 3})
