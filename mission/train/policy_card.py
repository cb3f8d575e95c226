"""`honeyguide card`: where a policy comes from and how good it was found to be, as a table.

In: the card in a policy file. Out: a row for what it says; cards of before a thing was kept say that it is not known.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Console
from rich.table import Table

from mission.console.terminal import print_line
from policies.learn.export.policy_file import PolicyCard, load_policy
from policies.learn.export.policy_path import find_policy

_OF_DATASET = ("episodes", "steps", "pilot", "seed", "rewards_by")


def show_card(name: str, console: Console) -> None:
    """Prints the card of a policy.

    Raises:
        CheckpointError: there is no such policy, or it cannot be read.
    """
    path = find_policy(name)
    table = Table(show_header=False)
    for row in card_rows(load_policy(path)[1]):
        table.add_row(*row)
    print_line(console, str(path))
    console.print(table)


def card_rows(card: PolicyCard) -> Iterator[tuple[str, str]]:
    """What a card says, and what of."""
    yield "task", _task(card.task, card.settings)
    yield "seed", str(card.seed)
    yield "steps", f"{card.steps:,}"
    if card.numbers:
        yield "task parameters", ", ".join(card.numbers)
    for measure, said in (("success", "success, judged"), ("band", "time in the band, judged")):
        if f"{measure}_rate" in card.figures:
            yield said, _rate(card.figures, "", measure, "episodes that it did not train on")
    if "training_success_rate" in card.figures:
        yield "success, training", _rate(card.figures, "training_", "success", "last episodes")
    if "training_reward" in card.figures:
        yield "reward, training", f"{card.figures['training_reward']:.3f}"
    yield "code", _code(card.code)
    if card.teacher:
        yield "teacher", _teacher(card.teacher)
    for data in card.data:
        said = ", ".join(f"{name} {data[name]}" for name in _OF_DATASET if name in data)
        yield f"data, {data['use']}", f"{data['path']}: {said}"
    for parent in card.parents:
        yield "began with", _leg(parent)


def _task(task: str, settings: Mapping[str, Any]) -> str:
    given = ", ".join(f"{key}={value}" for key, value in settings.items() if value not in ("", None, ()))
    return f"{task} ({given})" if given else task


def _rate(figures: Mapping[str, float], prefix: str, measure: str, what: str) -> str:
    """A rate, with its interval and how many episodes it is of, if the card has them."""
    text = f"{100.0 * figures[f'{prefix}{measure}_rate']:.2f} %"
    if f"{prefix}{measure}_low" in figures:
        low, high = (100.0 * figures[f"{prefix}{measure}_{end}"] for end in ("low", "high"))
        text += f" (95 %: {low:.2f} to {high:.2f})"
    count = figures.get(f"{prefix}episodes")
    return f"{text} of {count:,} {what}" if count is not None else text


def _code(code: Mapping[str, str]) -> str:
    return f"version {code['version']}, commit {code['commit']}" if code else "not known"


def _teacher(teacher: Mapping[str, Any]) -> str:
    known_by = teacher.get("weights_sha256", teacher.get("sha256", ""))  # older cards: of the whole file
    return f"{teacher['policy']}: {_leg(teacher['card'])}; {known_by[:12]}"


def _leg(card: Mapping[str, Any]) -> str:
    """Another policy's card, in short."""
    commit = card.get("code", {}).get("commit", "")
    said = f"{card['task']}, seed {card['seed']}, {card['steps']:,} steps" + (f", commit {commit}" if commit else "")
    return f"{said}; its teacher {_teacher(card['teacher'])}" if card.get("teacher") else said
