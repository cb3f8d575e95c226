"""The trained policies that ship with the project, by the name of their task: files of this folder."""

from importlib.resources import files
from pathlib import Path

from policies.tasks.catalogue import file_stem

DEFAULTS = {"FollowMe": "follow-me-tracked"}  # of tasks whose policies all have names of their own


def pretrained(name: str) -> Path | None:
    """The policy of a task (`ReachTarget`) or of that name (`reach-target`); None if none ships."""
    if ":" in name:  # a task of one's own may be called as ours is
        return None
    path = Path(str(files("policies.pretrained"))) / f"{DEFAULTS.get(name, file_stem(name))}.pt"
    return path if path.is_file() else None
