"""Each test works in a folder of its own, beside a run that was never interrupted."""

import os
from pathlib import Path

import pytest

from tests.unit.mission.train.training_run import RUN, train, write_config


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The folder of a run that was never interrupted."""
    folder = tmp_path_factory.mktemp("finished")
    before = Path.cwd()
    os.chdir(folder)
    try:
        write_config()
        result = train()
        assert result.exit_code == 0, result.output
    finally:
        os.chdir(before)
    return folder / RUN
