"""A scenario of a text, as a file has it."""

from mission.scenario.scenario_file import parse_scenario


def parsed(text, tmp_path):
    return parse_scenario(text, "hop.scenario.yaml", tmp_path)
