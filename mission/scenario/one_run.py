"""One run of a scenario, before and after: flown, kept if it is to be, and said how it is flown again.

In: a `Planned`. Out: a `Flown`. pytest flies it where it is, `honeyguide test` in a process, which it may take with it.
"""

import shlex
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mission.console.option_checks import UserError
from mission.scenario.flight.building import load_scenario_kernels
from mission.scenario.keeping import check_apart, emptied, is_under_way, keep_scenario, run_folder, run_names
from mission.scenario.result import ScenarioResult
from mission.scenario.runner import RESULT_FILE, run_scenario, write_result
from mission.scenario.scenario import Scenario
from mission.scenario.scenario_file import ScenarioFile


@dataclass(frozen=True, slots=True)
class Planned:
    """One run of one scenario."""

    scenario: Scenario
    file: str
    seed: int
    folder: Path | None
    """Where it is kept if it fails; None: nowhere."""
    keeps_all: bool = False
    """And if it passes."""
    has_mcap: bool = False
    """Those that are kept have an MCAP file beside each log."""

    @property
    def key(self) -> tuple[str, int]:
        return self.file, self.seed

    def refused(self, refusal: str) -> ScenarioResult:
        """The result of a run that cannot be flown at all."""
        return replace(self.unjudged(refusal), folder="")

    def unjudged(self, error: str) -> ScenarioResult:
        """The result of a run that did not come to its end."""
        name, folder = self.scenario.name or "scenario", "" if self.folder is None else str(self.folder)
        return ScenarioResult(name, self.file, self.seed, (), error, folder=folder)


@dataclass(frozen=True, slots=True)
class Flown:
    """What came of it."""

    result: ScenarioResult | None
    refusal: str = ""
    """Why it could not be flown at all."""
    command: str = ""
    """That flies a kept run again."""
    note: str = ""
    """What was not kept of it, and why."""


def planned_runs(
    files: Sequence[ScenarioFile], seeds: Sequence[int] | None, keep: Path | None, *, keeps_all: bool, has_mcap: bool
) -> list[Planned]:
    """The runs of scenarios, each once.

    Args:
        files: the scenarios.
        seeds: of each; None: its own.
        keep: where runs that fail are kept; None: nowhere.
        keeps_all: those that pass, too.
        has_mcap: those that are kept have an MCAP file beside each log.

    Raises:
        UserError: a run would be kept where its scenario is.
    """
    names = run_names([(file.path, file.scenario.name) for file in files])
    planned = [
        Planned(
            file.scenario,
            str(file.path),
            seed,
            None if keep is None else run_folder(keep, name, seed),
            keeps_all=keeps_all,
            has_mcap=has_mcap,
        )
        for file, name in zip(files, names, strict=True)
        for seed in dict.fromkeys(seeds or file.scenario.seeds)
    ]
    check_apart([each.folder for each in planned if each.folder is not None], [file.path for file in files])
    return planned


class ScenarioRuns:
    """Runs of scenarios, as worker processes do them."""

    def prepare(self, planned: Sequence[Planned]) -> None:
        for each in planned:
            load_scenario_kernels(each.scenario)

    def outcomes(self, planned: Sequence[Planned]) -> list[Flown]:
        return [fly(each) for each in planned]

    def lost(self, planned: Planned, reason: str) -> Flown:
        """A run whose process ended or hung; what was written of its logs is kept."""
        result, folder = planned.unjudged(reason), planned.folder
        try:
            if folder is None:
                return Flown(result)
            if not is_under_way(folder):  # it was lost before it began there
                emptied(folder).mkdir(parents=True)
            write_result(folder, result)
            return Flown(result, command=keep_scenario(folder, planned.scenario, planned.seed))
        except UserError as error:
            return Flown(replace(result, folder=""), note=str(error))
        except OSError as error:
            return Flown(result, note=_unwritten(planned, error))


def fly(planned: Planned) -> Flown:
    """One run, in this process."""
    folder = planned.folder
    try:
        if folder is not None:  # from now on it is a kept run, whatever ends this process
            emptied(folder).mkdir(parents=True)
            write_result(folder, planned.unjudged("its process was ended"))
        result = _judged(planned)
    except UserError as error:
        return Flown(None, planned.scenario.refusal(error, planned.file))
    except OSError as error:
        return Flown(None, _unwritten(planned, error))
    try:
        return _kept(planned, result)
    except OSError as error:
        return Flown(result, note=_unwritten(planned, error))


def _judged(planned: Planned) -> ScenarioResult:
    """The result of a run, whose folder is there.

    Raises:
        UserError: it cannot be flown, or a file cannot be read; nothing is left in its place.
    """
    try:
        return run_scenario(planned.scenario, planned.seed, folder=planned.folder, file=planned.file)
    except (UserError, OSError) as error:
        if planned.folder is not None:
            shutil.rmtree(planned.folder)
        if isinstance(error, UserError):
            raise
        raise UserError(f"{error.filename or planned.file}: {error.strerror or error}") from error


def _kept(planned: Planned, result: ScenarioResult) -> Flown:
    """A run that was judged, kept if it is to be.

    Raises:
        OSError: it cannot be.
    """
    folder = planned.folder
    if folder is None:
        return Flown(result)
    if result.passed and not planned.keeps_all:
        shutil.rmtree(folder)
        return Flown(replace(result, folder="", ulogs=(), tlogs=()))
    note = _mcap_trouble(result) if planned.has_mcap else ""
    return Flown(result, command=keep_scenario(folder, planned.scenario, planned.seed), note=note)


def _mcap_trouble(result: ScenarioResult) -> str:
    """Writes an MCAP file beside each log; why one could not be written, "": all are."""
    from mission.foxglove.convert import ConversionError, convert

    try:
        for ulog in map(Path, result.ulogs):
            convert(ulog, ulog.with_suffix(".mcap"))
    except (ConversionError, OSError) as error:
        return f"--mcap: {error}"
    return ""


def _unwritten(planned: Planned, error: OSError) -> str:
    return f"{error.filename or planned.folder}: cannot be written: {error.strerror or error}"


def failure_lines(flown: Flown) -> list[str]:
    """What failed of a run, and how it is flown again."""
    result = flown.result
    if result is None:
        return [flown.refusal]
    is_kept = (Path(result.file).parent / RESULT_FILE).is_file()
    again = f"honeyguide test {shlex.quote(result.file)} --seeds {result.seed}{'' if is_kept else ' --keep failed'}"
    how = f"kept in {result.folder}; again: {flown.command}" if flown.command else f"again: {again}"
    done = [f"  {time_s:.1f} s {text}" for time_s, _, text in result.events]
    return [f"{result.name}, seed {result.seed}:", *(f"  {text}" for text in result.failures), *done, f"  {how}"]
