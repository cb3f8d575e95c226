"""Where the policy lies that a user means. Light to import: a wrong name is told before torch is loaded."""

from pathlib import Path

from policies.pretrained.pretrained_policies import pretrained


class CheckpointError(ValueError):
    """A checkpoint or policy file that cannot be read or written; the message is one sentence for the user."""


def find_policy(name: str) -> Path:
    """The policy that a user means: a file, a run's folder, the name of a run in `results/`, or a task that ships one.

    Raises:
        CheckpointError: there is none.
    """
    if Path(name).is_file():
        return Path(name)
    for folder in (Path(name), Path("results") / name):
        if folder.is_dir():
            found = sorted(folder.glob("*.pt")) or sorted(folder.glob("*/*.pt"), key=_steps)[-1:]
            if len(found) == 1:
                return found[0]
            raise CheckpointError(f"{folder}: {'several policies' if found else 'no policy'} in it; name a .pt file")
    shipped = pretrained(name)
    if shipped is not None:
        return shipped
    raise CheckpointError(f"{name}: no such policy file, and no such run in results/")


def _steps(checkpoint: Path) -> int:
    steps = checkpoint.stem.rpartition("-")[2]
    return int(steps) if steps.isdigit() else -1
