"""The commands that show, drive and record learning tasks: `honeyguide demonstrate`, `play` and `drive`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from mission.console.command_refusal import learn_extra, refuse
from mission.console.name_checks import check_task, check_task_or_policy
from mission.console.terminal import loading

_TASK = typer.Argument(
    help="A task's name: RollerBall, ReachTarget, Parking1, Parking2, FollowMe, Hover, Drive, Navigate; "
    "or module:Class of your own."
)
_EnvArgs = Annotated[
    list[str] | None, typer.Option(help="A setting of the task: KEY=VALUE, as preset=improved. Repeatable.")
]
_Seed = Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Seed of places and numbers.")]


def demonstrate(
    task: Annotated[str, _TASK],
    out: Annotated[Path, typer.Option(help="The folder to make: a Minari dataset.")],
    episodes: Annotated[int, typer.Option(min=1, max=1_000_000, help="How many to record.")] = 100,
    env_args: _EnvArgs = None,
    seed: _Seed = 0,
    failures: Annotated[bool, typer.Option("--failures", help="Keep episodes that failed, too.")] = False,
) -> None:
    """Record demonstrations of a task's scripted expert."""
    with learn_extra():
        check_task(task)
        from mission.train.demonstrate import DemonstrateOptions, demonstrate_task
        from policies.experts.catalogue import NoExpert
        from policies.experts.demonstration_file import DemonstrationFileError
        from policies.experts.episode_recording import RecordingError
        from policies.tasks.catalogue import UnknownTask
        from policies.tasks.task_error import TaskError

        options = DemonstrateOptions(task, out, episodes, seed, tuple(env_args or ()), failures)
        try:
            demonstrate_task(options, Console())
        except (UnknownTask, TaskError, NoExpert, RecordingError, DemonstrationFileError) as error:
            refuse(str(error))


def play(
    task_or_policy: Annotated[str, typer.Argument(help="A task, or a policy: a file, a run's folder, or its name.")],
    policy: Annotated[str | None, typer.Option(help="A policy, to play it in the named task.")] = None,
    expert: Annotated[bool, typer.Option("--expert", help="The scripted expert, even if a policy ships.")] = False,
    random: Annotated[bool, typer.Option("--random", help="Actions by chance.")] = False,
    mp4: Annotated[Path | None, typer.Option(help="Write a film instead of opening a window.")] = None,
    episodes: Annotated[int, typer.Option(min=1, max=100_000, help="End after this many.")] = 5,
    envs: Annotated[int, typer.Option(min=1, max=64, help="Environments side by side.")] = 1,
    env_args: _EnvArgs = None,
    seed: _Seed = 0,
) -> None:
    """Watch a trained policy, a task's expert, or chance, in a window or as a film."""
    with learn_extra():
        check_task_or_policy(task_or_policy)
        with loading(Console()):
            from mission.train.keyboard_window import WindowError
            from mission.train.play import PlayError, PlayOptions, play_task
            from mission.video.video_file import VideoError
            from policies.experts.catalogue import NoExpert
            from policies.tasks.catalogue import UnknownTask
            from policies.tasks.layout import LayoutError
            from policies.tasks.task_error import TaskError

        options = PlayOptions(task_or_policy, episodes, envs, seed, tuple(env_args or ()), policy, random, expert, mp4)
        try:
            typer.echo(play_task(options, Console()))
        except (UnknownTask, TaskError, NoExpert, PlayError, LayoutError, WindowError, VideoError) as error:
            refuse(str(error))


def drive(
    task: Annotated[str, _TASK],
    record: Annotated[Path | None, typer.Option(help="Keep the episodes that succeed: a Minari dataset.")] = None,
    failures: Annotated[bool, typer.Option("--failures", help="Keep episodes that failed, too.")] = False,
    episodes: Annotated[int | None, typer.Option(min=1, help="End after this many.")] = None,
    speed: Annotated[float, typer.Option(min=0.01, max=100.0, help="Times real time.")] = 1.0,
    env_args: _EnvArgs = None,
    seed: _Seed = 0,
) -> None:
    """Drive a task yourself: arrow keys or WASD, space brakes, R restarts, Esc ends."""
    with learn_extra():
        check_task(task)
        from mission.train.drive import DriveOptions, drive_task
        from mission.train.keyboard_window import WindowError
        from policies.experts.demonstration_file import DemonstrationFileError
        from policies.experts.keyboard import NoKeys
        from policies.tasks.catalogue import UnknownTask
        from policies.tasks.task_error import TaskError

        options = DriveOptions(task, seed, tuple(env_args or ()), episodes, record, failures, speed)
        try:
            typer.echo(drive_task(options))
        except (UnknownTask, TaskError, NoKeys, WindowError, DemonstrationFileError) as error:
            refuse(str(error))
