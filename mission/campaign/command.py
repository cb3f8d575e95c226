"""The command that flies campaigns: `honeyguide campaign`. Light to import."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from mission.console.command_refusal import learn_extra, refuse
from mission.console.terminal import loading

if TYPE_CHECKING:
    from mission.campaign.campaign import Campaign
    from mission.campaign.flying import Workers

BATCH = 50  # runs in one launch: more take memory, and are no faster each
RUN_MAX_S = 300.0  # wall clock; a two-minute flight takes a second or two


def fly_campaign_file(
    file: Annotated[Path | None, typer.Argument(help="Campaign file.", show_default=False)] = None,
    runs: Annotated[int | None, typer.Option(min=0, help="Samples. Default: as many as the file says.")] = None,
    folder: Annotated[
        Path | None, typer.Option(help="Where runs and report go. Default: campaigns/NAME.", show_default=False)
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Only go on with what the folder holds; without it that is done, too.")
    ] = False,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes at a time. Default: one per core.")] = None,
    run_max: Annotated[
        float, typer.Option(min=1.0, help="A run that takes longer [s, wall clock] hangs, and is given up.")
    ] = RUN_MAX_S,
    batch: Annotated[
        bool, typer.Option("--batch", help="Fly many in one launch of the kernels, without MAVLink: where it can be.")
    ] = False,
    ray: Annotated[str | None, typer.Option(metavar="ADDRESS", help="Fly on this Ray cluster instead.")] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON schema of campaign files, and end.")] = False,
) -> None:
    """Fly a scenario many times over distributions: 0 done, 1 less success than required, 2 wrong input."""
    from mission.console.option_checks import UserError

    if schema:
        from mission.campaign.schema import schema_text

        typer.echo(schema_text(), nl=False)
        return
    try:
        from mission.campaign.batch.refusal import batch_refusal
        from mission.campaign.campaign_file import read_campaign

        if file is None:
            raise UserError("campaign: name a campaign file")
        campaign = read_campaign(file)
        if runs is not None:
            campaign = campaign.model_copy(update={"runs": runs})
        with learn_extra():
            if batch and (ray is not None or (why := batch_refusal(campaign))):
                raise UserError("--batch and --ray: choose one" if ray is not None else why)
            with loading(Console(stderr=True)):
                from mission.campaign.checking import check_campaign
                from mission.campaign.session import campaign_session

                check_campaign(campaign, str(file))
            count = jobs or len(os.sched_getaffinity(0))
            code = campaign_session(
                campaign,
                folder or Path("campaigns") / campaign.name,
                lambda: _workers(campaign, count, run_max, ray, is_batch=batch),
                lambda logs: _loggers(campaign, count, run_max, logs),
                must_exist=resume,
            )
    except UserError as error:
        refuse(str(error))
    raise typer.Exit(code)


def _workers(campaign: "Campaign", jobs: int, run_max_s: float, ray: str | None, *, is_batch: bool) -> "Workers":
    if ray is not None:
        from mission.campaign.workers.ray_cluster import RayCluster

        return RayCluster(campaign, ray)
    from mission.campaign.workers.processes import Processes

    return Processes(campaign, jobs, run_max_s, BATCH if is_batch else 1)


def _loggers(campaign: "Campaign", jobs: int, run_max_s: float, logs: Path) -> "Workers":
    from mission.campaign.workers.processes import Processes

    return Processes(campaign, jobs, run_max_s, logs=logs)
