"""Scenario files as tests: each is collected with one item per seed, flown as `honeyguide test` flies it.

Light to import: pytest may ask for the collector of a file that is not to be run.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from mission.scenario.scenario import Scenario


_NAMES = pytest.StashKey[dict[Path, str]]()
"""The scenario of each file that was collected, whichever tests are selected then."""


class ScenarioFileCollector(pytest.File):
    """A scenario file."""

    def collect(self) -> Iterator[pytest.Item]:
        from mission.pytest_plugin.refusal import refused
        from mission.scenario.scenario_file import read_scenario

        with refused():
            scenario = read_scenario(self.path)
        self.session.stash.setdefault(_NAMES, {})[self.path] = scenario.name
        for seed in scenario.seeds:
            yield ScenarioItem.from_parent(self, name=f"seed{seed}", scenario=scenario, seed=seed)


class ScenarioFailed(Exception):
    """It was flown and has not passed; the message says what failed."""


class ScenarioItem(pytest.Item):
    """One run of a scenario."""

    def __init__(self, *, scenario: "Scenario", seed: int, **given: Any) -> None:
        super().__init__(**given)
        self._scenario, self._seed = scenario, seed

    def runtest(self) -> None:
        from mission.pytest_plugin.refusal import refused
        from mission.scenario.one_run import Planned, failure_lines, fly

        if self.config.getoption("link"):
            pytest.skip("scenario files are flown in simulation, not over --link")
        with refused():
            folder = self._folder()
        planned = Planned(
            self._scenario, str(self.path), self._seed, folder, keeps_all=self.config.getoption("honeyguide_keep_all")
        )
        flown = fly(planned)
        if flown.refusal or flown.result is None:
            pytest.fail(flown.refusal, pytrace=False)
        if not flown.result.passed:
            raise ScenarioFailed("\n".join(failure_lines(flown)))

    def _folder(self) -> Path | None:
        """Where it is kept; None: nowhere."""
        from mission.scenario.keeping import check_apart, run_folder, run_names

        keep: Path | None = self.config.getoption("honeyguide_keep")
        if keep is None:
            return None
        names = self.session.stash[_NAMES]
        kept_as = dict(zip(names, run_names(list(names.items())), strict=True))
        folder = run_folder(keep, kept_as[self.path], self._seed)
        check_apart([folder], [self.path])
        return folder

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        if isinstance(excinfo.value, ScenarioFailed):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return self.path, None, f"{self.path.name}: {self.name}"
