"""The commands of `honeyguide dataset`: build, collect, show, judge, model, fit, merge, split, filter, export."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from mission.console.command_refusal import learn_extra, refuse
from mission.console.interrupts import signals_interrupt
from mission.console.name_checks import check_task
from mission.console.terminal import loading

app = typer.Typer(
    no_args_is_help=True, rich_markup_mode=None, help="Datasets of flights and episodes, to train from without flying."
)

_Out = Annotated[Path, typer.Option("--output", "-o", help="The folder to make: a Minari dataset.")]
_Source = Annotated[Path, typer.Argument(help="A dataset's folder.")]
_EnvArgs = Annotated[list[str] | None, typer.Option(help="A setting of the task: KEY=VALUE, as stack=3. Repeatable.")]
_Seed = Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Seed of all draws.")]


@contextmanager
def _refusing() -> Iterator[None]:
    """What a user can get wrong gives one sentence, and whoever ends the command finds no half of a dataset."""
    with learn_extra():
        from mission.train.play import PlayError
        from mission.video.video_file import VideoError
        from policies.datasets.episodes import DatasetError
        from policies.experts.catalogue import NoExpert
        from policies.experts.demonstration_file import DemonstrationFileError
        from policies.tasks.catalogue import UnknownTask
        from policies.tasks.layout import LayoutError
        from policies.tasks.task_params import NumberError

        try:
            with signals_interrupt():
                yield
        except (DatasetError, DemonstrationFileError, LayoutError, NoExpert, NumberError, PlayError) as error:
            refuse(str(error))
        except (UnknownTask, VideoError) as error:
            refuse(str(error))


@app.command()
def build(
    sources: Annotated[list[Path], typer.Argument(help="Logs (.ulg, .tlog), folders of runs, or folders of those.")],
    task: Annotated[str, typer.Option(help="FollowMe, Navigate, NavigateRover, Drive or Hover.")],
    output: _Out,
    env_args: _EnvArgs = None,
    truth: Annotated[
        bool, typer.Option("--truth/--no-truth", help="Rewards by the simulator's truth, where all logs hold it.")
    ] = True,
    others: Annotated[
        bool, typer.Option("--others", help="Count what another flew while the companion looked on, too.")
    ] = False,
    number: Annotated[
        list[str] | None, typer.Option(help="A number of the task, as its reward weighs: NAME=VALUE. Repeatable.")
    ] = None,
    images: Annotated[bool, typer.Option("--images", help="Keep the pictures beside the observations.")] = False,
) -> None:
    """Build a dataset from logged flights."""
    with _refusing():
        with loading(Console()):
            from mission.dataset.build import BuildOptions, build_dataset

        chosen = (truth, others, images, tuple(number or ()))
        options = BuildOptions(tuple(sources), task, output, tuple(env_args or ()), *chosen)
        build_dataset(options, Console())


@app.command()
def collect(
    task: Annotated[str, typer.Argument(help="A task's name, or module:Class of your own.")],
    policy: Annotated[str, typer.Option(help="Who drives: a policy, or 'expert' or 'random'.")],
    output: _Out,
    episodes: Annotated[int, typer.Option(min=1, max=10_000_000, help="How many.")] = 100,
    noise: Annotated[
        float, typer.Option(min=0.0, max=2.0, help="On its actions: standard deviation; of choices how often.")
    ] = 0.0,
    env_args: _EnvArgs = None,
    seed: _Seed = 0,
    shards: Annotated[
        int | None, typer.Option(min=1, help="Collect in so many parts, which are kept when it is interrupted.")
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="With --shards: processes at a time. Default: one per core.")
    ] = None,
    ray: Annotated[str | None, typer.Option(help="With --shards: address of a Ray head, HOST:PORT.")] = None,
) -> None:
    """Collect episodes of the batch simulator as a dataset."""
    for option, value in (("--jobs", jobs), ("--ray", ray)):
        if value is not None and shards is None:
            refuse(f"{option}: goes with --shards")
    if jobs is not None and ray is not None:
        refuse("--jobs: not with --ray, whose cluster has its own")
    with _refusing():
        check_task(task)
        with loading(Console()):
            from mission.dataset.collect import collect_dataset
            from mission.dataset.write_episodes import CollectOptions

        settings = tuple(env_args or ())
        options = CollectOptions(task, policy, episodes, output, noise, seed, settings, shards, jobs, ray)
        collect_dataset(options, Console())


@app.command()
def show(
    dataset: _Source,
    picture: Annotated[Path | None, typer.Option(help="Write histograms as a PNG.")] = None,
    mp4: Annotated[Path | None, typer.Option(help="Write a film of an episode.")] = None,
    episode: Annotated[int, typer.Option(min=0, help="Which episode the film shows.")] = 0,
) -> None:
    """Show what a dataset comes to: statistics, histograms, a film of an episode."""
    with _refusing():
        from mission.dataset.show import show_dataset

        show_dataset(dataset, Console(), picture=picture, film=mp4, episode=episode)


@app.command()
def judge(
    datasets: Annotated[list[Path], typer.Argument(help="Datasets of one task and layout.")],
    policy: Annotated[list[str], typer.Option(help="A policy: a file, a run or a name. Repeatable.")],
    gamma: Annotated[
        float | None, typer.Option(min=0.0, max=0.9999, help="Discount; left out: that of the task's recipe.")
    ] = None,
    width: Annotated[float, typer.Option(min=0.01, max=2.0, help="Of the Gaussian around a policy's actions.")] = 0.4,
    clip: Annotated[float, typer.Option(min=1.0, help="Of importance weights, from above.")] = 1000.0,
    steps: Annotated[int, typer.Option(min=1, help="Gradient steps of fitted Q evaluation.")] = 3000,
    picture: Annotated[Path | None, typer.Option(help="Write where policies leave the data as a PNG.")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the figures as JSON.")] = None,
    seed: _Seed = 0,
) -> None:
    """Judge policies without flying: returns from recorded decisions, with intervals."""
    with _refusing():
        with loading(Console()):
            from mission.dataset.judge import JudgeOptions, judge_policies

        files = picture, json_file
        options = JudgeOptions(tuple(datasets), tuple(policy), gamma, width, clip, steps, seed, *files)
        judge_policies(options, Console())


@app.command()
def model(
    datasets: Annotated[list[Path], typer.Argument(help="Datasets of one task and layout.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="The file to make, which `train` takes as model:FILE.")
    ],
    steps: Annotated[int, typer.Option(min=1, help="Gradient steps at most.")] = 20_000,
    hidden: Annotated[int, typer.Option(min=1, max=4096, help="Units of each of two layers.")] = 128,
    seed: _Seed = 0,
) -> None:
    """Learn a model of a task's dynamics, to train in where no simulator fits."""
    with _refusing():
        with loading(Console()):
            from policies.datasets.episodes import DatasetError
            from policies.learn.rollout.demonstrations import DemonstrationError
            from policies.offline.dynamics.model_file import ModelError, fit_and_save

        try:
            made = fit_and_save([str(path) for path in datasets], output, steps=steps, seed=seed, hidden=hidden)
        except (DemonstrationError, ModelError) as error:
            raise DatasetError(str(error)) from error
        typer.echo(f"{output}: explains {100 * (1 - made.networks.held_out):.1f} % of held-out variance")


@app.command()
def fit(
    sources: Annotated[list[Path], typer.Argument(help="ULogs of one vehicle, folders of runs, or folders of those.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The airframe's file to make: .toml.")],
    airframe: Annotated[str, typer.Option(help="What to begin with: an airframe's name or TOML file.")] = "x500",
    mass: Annotated[
        float | None, typer.Option(min=0.01, max=1000.0, help="What the vehicle weighs [kg], which no log tells.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Write what was predicted and logged as a PNG.")] = None,
) -> None:
    """Fit the simulator's numbers of an airframe to logged flights."""
    if output.suffix != ".toml":
        refuse(f"-o {output}: an airframe's file ends with .toml")
    with _refusing():
        with loading(Console()):
            from mission.dataset.fit.fit_logs import FitOptions, fit_logs

        fit_logs(FitOptions(tuple(sources), airframe, output, mass, picture), Console())


@app.command()
def merge(
    datasets: Annotated[list[Path], typer.Argument(help="Datasets of one task and layout.")], output: _Out
) -> None:
    """Make one dataset of several."""
    with _refusing():
        from policies.datasets.editing import merge as merged

        typer.echo(f"{output}: {merged(datasets, output)} episodes")


@app.command()
def split(
    dataset: _Source,
    output: Annotated[list[Path], typer.Option("--output", "-o", help="The two folders to make.")],
    fraction: Annotated[float, typer.Option(min=0.0, max=1.0, help="Of the episodes, that go to the first.")] = 0.9,
    seed: _Seed = 0,
) -> None:
    """Split a dataset by whole episodes."""
    if len(output) != 2:
        refuse(f"-o: a split makes two folders, and {len(output)} are named")
    with _refusing():
        from policies.datasets.editing import split as split_in_two

        counts = split_in_two(dataset, fraction, seed, (output[0], output[1]))
        typer.echo(", ".join(f"{folder}: {count} episodes" for folder, count in zip(output, counts, strict=True)))


@app.command(name="filter")
def filter_episodes(
    dataset: _Source,
    output: _Out,
    outcome: Annotated[list[str] | None, typer.Option(help="Keep episodes that ended so: success. Repeatable.")] = None,
    min_return: Annotated[float | None, typer.Option(help="Keep episodes of at least this return.")] = None,
    min_steps: Annotated[int | None, typer.Option(min=1, help="Keep episodes of at least so many decisions.")] = None,
) -> None:
    """Keep some of a dataset's episodes."""
    with _refusing():
        from policies.datasets.editing import keep
        from policies.datasets.episodes import EpisodeRows

        def is_kept(episode: EpisodeRows) -> bool:
            return (
                (not outcome or episode.outcome in outcome)
                and (min_return is None or float(episode.rewards.sum()) >= min_return)
                and (min_steps is None or len(episode) >= min_steps)
            )

        typer.echo(f"{output}: {keep(dataset, output, is_kept)} episodes")


@app.command()
def export(
    dataset: _Source,
    output: Annotated[Path, typer.Option("--output", "-o", help="The file or folder to make.")],
    to: Annotated[Literal["d4rl", "lerobot"], typer.Option(help="d4rl: one HDF5 file; lerobot: a parquet folder.")],
) -> None:
    """Export a dataset for the tools of others."""
    with _refusing():
        from policies.datasets.exporting import export_d4rl
        from policies.datasets.exporting_lerobot import export_lerobot

        try:
            steps = export_d4rl(dataset, output) if to == "d4rl" else export_lerobot(dataset, output)
        except ModuleNotFoundError as error:
            if error.name != "pyarrow":
                raise
            refuse("--to lerobot: this needs pyarrow, which comes with the extra 'lerobot' (docs/start/installing.md)")
        typer.echo(f"{output}: {steps} decisions")
