"""The scenarios that ship pass, and the page's example as it stands there; logs are the same at each run."""

import pytest

from mission.scenario.runner import run_scenario
from mission.scenario.scenario_file import READY, find_files, parse_scenario, read_scenario
from tests.documents import ROOT, blocks

PAGE = ROOT / "docs" / "how-to" / "scenarios.md"
REPEATED = ("landing-on-a-rover", "gnss-jamming", "forest-crossing")
OTHERS = tuple(name for path in find_files([READY]) if (name := path.name.partition(".")[0]) not in REPEATED)


def scenario(name):
    return read_scenario(READY / f"{name}.scenario.yaml")


@pytest.mark.parametrize("name", OTHERS)
def test_scenario_passes(name):
    result = run_scenario(scenario(name))
    assert result.passed, result.failures


@pytest.mark.parametrize("name", REPEATED)
def test_scenario_passes_and_its_logs_are_the_same_bytes_at_each_run(name, tmp_path):
    def logs(folder):
        result = run_scenario(scenario(name), folder=folder)
        assert result.passed, result.failures
        paths = [*result.ulogs, *result.tlogs]
        assert paths
        return [(ROOT / path).read_bytes() for path in paths]

    assert logs(tmp_path / "first") == logs(tmp_path / "again")


def example():
    (text,) = [block for block in blocks(PAGE, "yaml") if block.startswith("# delivery")]
    return parse_scenario(text, "delivery.scenario.yaml", ROOT)


@pytest.mark.parametrize("seed", example().seeds)
def test_the_example_of_the_page_passes(seed):
    result = run_scenario(example(), seed)
    assert result.passed, result.failures
