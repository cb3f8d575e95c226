"""The commands that train and judge policies: `honeyguide train`, `eval`, `export` and `card`.

`train` has every flag of ML-Agents' `mlagents-learn`; those that make no sense without Unity are accepted and say so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from mission.console.command_refusal import learn_extra, refuse
from mission.console.name_checks import check_policy, check_recipe
from mission.console.terminal import loading

if TYPE_CHECKING:
    from policies.learn.config.command_line import CommandLine

_EnvArgs = Annotated[
    list[str] | None, typer.Option(help="A setting of the task: KEY=VALUE, as preset=improved. Repeatable.")
]
_Strict = Annotated[
    bool, typer.Option("--strict", help="Drop misplaced keys as ML-Agents does: no network memory from flat keys.")
]
_Processes = Annotated[
    int | None, typer.Option(min=1, max=64, help="Processes that train together, by an offline algorithm.")
]
_TASK_OR_CONFIG = typer.Argument(
    help="A task or recipe by name, module:Class of a task of yours, or an ML-Agents .yaml file."
)
_NO_EFFECT = "Accepted for ML-Agents' command lines; no effect."
_OLD = "Old name"
_POLICY = typer.Argument(help="A policy file (.pt), a run's folder, or the name of a run in results/.")


def train(
    context: typer.Context,
    task_or_config: Annotated[str | None, _TASK_OR_CONFIG] = None,
    env: Annotated[str | None, typer.Option(help="The task, if the .yaml file or the recipe names none.")] = None,
    gym: Annotated[str | None, typer.Option(help="An environment of Gymnasium instead of a task: its ID.")] = None,
    run_id: Annotated[str | None, typer.Option(help="Name of the run. Default: the recipe's, or ppo.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run where it stopped.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite a run of this name.")] = False,
    initialize_from: Annotated[str | None, typer.Option(help="Start from the networks of this run.")] = None,
    inference: Annotated[bool, typer.Option("--inference", help="Play the run's policy; learn nothing.")] = False,
    deterministic: Annotated[
        bool, typer.Option("--deterministic", help="With --inference: likeliest actions.")
    ] = False,
    seed: Annotated[int | None, typer.Option(help="Seed of every random draw. Default: a new one.")] = None,
    num_envs: Annotated[int | None, typer.Option(help="Copies of the num-areas environments.")] = None,
    num_areas: Annotated[int | None, typer.Option(help="Environments side by side.")] = None,
    env_args: _EnvArgs = None,
    behavior: Annotated[str | None, typer.Option(help="Which behaviour of a file that has several.")] = None,
    strict: _Strict = False,
    results_dir: Annotated[str | None, typer.Option(help="Folder of all runs. Default: results.")] = None,
    torch_device: Annotated[str | None, typer.Option(help="Where networks are computed: cpu, cuda.")] = None,
    processes: _Processes = None,
    keep_checkpoints: Annotated[int | None, typer.Option(help="How many of the newest checkpoints stay.")] = None,
    save_freq: Annotated[int | None, typer.Option(help="Steps between checkpoints.")] = None,
    curriculum: Annotated[str | None, typer.Option(help="A curriculum file of ML-Agents 0.15.")] = None,
    sampler: Annotated[str | None, typer.Option(help="A sampler file of ML-Agents 0.15.")] = None,
    lesson: Annotated[int | None, typer.Option(help="The lesson curricula begin with, from 0.")] = None,
    load: Annotated[bool, typer.Option("--load", help=f"{_OLD} of --resume.")] = False,
    cpu: Annotated[bool, typer.Option("--cpu", help=f"{_OLD} of --torch-device cpu.")] = False,
    train: Annotated[bool, typer.Option("--train", help="Training is what happens anyway.")] = False,
    debug: Annotated[bool, typer.Option("--debug", help=_NO_EFFECT)] = False,
    base_port: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    timeout_wait: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    width: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    height: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    quality_level: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    time_scale: Annotated[float | None, typer.Option(help=_NO_EFFECT)] = None,
    target_frame_rate: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    capture_frame_rate: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    no_graphics: Annotated[bool, typer.Option("--no-graphics", help=_NO_EFFECT)] = False,
    no_graphics_monitor: Annotated[bool, typer.Option("--no-graphics-monitor", help=_NO_EFFECT)] = False,
    max_lifetime_restarts: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    restarts_rate_limit_n: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    restarts_rate_limit_period_s: Annotated[int | None, typer.Option(help=_NO_EFFECT)] = None,
    torch: Annotated[bool, typer.Option("--torch", help=_NO_EFFECT)] = False,
    tensorflow: Annotated[bool, typer.Option("--tensorflow", help=_NO_EFFECT)] = False,
) -> None:
    """Train a policy on a task, by one of our recipes or by an ML-Agents configuration."""
    options = locals()  # all that was given: nothing else has a name yet
    with learn_extra():
        if task_or_config is not None:
            check_recipe(task_or_config)
        with loading(Console()):
            from mission.train.training import USER_ERRORS, TrainingRequest, train_run
        given = _command_line(options, context.args)
        try:
            train_run(TrainingRequest(task_or_config, given, behavior, strict), Console())
        except USER_ERRORS as error:
            refuse(str(error))


def _command_line(options: Mapping[str, Any], further: Sequence[str]) -> "CommandLine":
    """ML-Agents' flags as they were given: the options of `train` that have their names.

    Args:
        options: of `train`, and their values.
        further: what follows them.
    """
    from policies.learn.config.command_line import CommandLine

    env_args, gym, env = options["env_args"], options["gym"], options["env"]
    if gym is not None and env is not None:
        refuse("--gym: not with --env, which names the task already")
    if further and env_args is None:
        refuse(f"{further[0]}: not expected; settings of the task go after --env-args")
    pairs = (*env_args, *further) if env_args is not None else None  # ML-Agents takes all that follow
    flags = {flag.name: options[flag.name] for flag in fields(CommandLine)}
    return CommandLine(**flags | {"env_args": pairs, "env": env if gym is None else f"gym:{gym}"})


def evaluate(
    policy: Annotated[str, _POLICY],
    task: Annotated[
        str | None, typer.Option(help="Another task of the same layout. Default: the policy's, unless it is yours.")
    ] = None,
    env_args: _EnvArgs = None,
    episodes: Annotated[int, typer.Option(min=1, max=10_000_000, help="How many are played.")] = 1000,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Seed of the episodes.")] = 0,
    drawn: Annotated[bool, typer.Option("--drawn", help="Draw actions instead of taking the most probable.")] = False,
) -> None:
    """Play a policy on episodes it was not trained on, and count how they end."""
    with learn_extra():
        check_policy(policy)
        with loading(Console()):
            from mission.train.training import USER_ERRORS, evaluate_policy

        try:
            evaluate_policy(policy, task, tuple(env_args or ()), (episodes, seed), Console(), is_drawn=drawn)
        except USER_ERRORS as error:
            refuse(str(error))


def export(
    policy: Annotated[str, _POLICY],
    output: Annotated[Path | None, typer.Argument(help="The .onnx file to write. Default: beside the policy.")] = None,
) -> None:
    """Write a policy as an ONNX network with ML-Agents' names."""
    with learn_extra():
        check_policy(policy)
        with loading(Console()):
            from mission.train.training import USER_ERRORS, export_network

        try:
            export_network(policy, output, Console())
        except USER_ERRORS as error:
            refuse(str(error))


def card(policy: Annotated[str, _POLICY]) -> None:
    """Show where a policy comes from: task, code, teacher, datasets, and how good it was found to be."""
    with learn_extra():
        check_policy(policy)
        with loading(Console()):
            from mission.train.policy_card import show_card
            from policies.learn.export.policy_path import CheckpointError

        try:
            show_card(policy, Console())
        except CheckpointError as error:
            refuse(str(error))
