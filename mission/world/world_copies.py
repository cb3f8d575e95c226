"""A run keeps the world that it was flown in: the files that a world names, copied into the run's folder.

A run that is moved, or whose meshes have changed meanwhile, is then still shown as it was flown.
"""

import hashlib
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from common.files import write_whole

FOLDER = "world"
_FILE_KEYS = ("file", "texture")
_NAMED = re.compile(r"^\s*(?:mtllib|map_\w+|bump|disp|decal)\s+(?:-\S+\s+\S+\s+)*(\S.*?)\s*$", re.MULTILINE)


def with_copies(given: Any, run_folder: Path) -> Any:
    """What a world is made from, its files copied.

    Args:
        given: of a `WorldFile`, as plain data.
        run_folder: of the run; each file goes to a folder of its own in `world/`, with those that it names.

    Returns:
        The same, in which files are named relative to the run's folder.

    Raises:
        OSError: a file cannot be copied.
    """
    if isinstance(given, list):
        return [with_copies(each, run_folder) for each in given]
    if not isinstance(given, dict):
        return given
    return {
        key: _copy(Path(value), run_folder)
        if key in _FILE_KEYS and isinstance(value, str)
        else with_copies(value, run_folder)
        for key, value in given.items()
    }


def keep_world_file(file: Path, run_folder: Path) -> str:
    """A world file kept beside a run's logs, with all that it names; its name relative to the run's folder.

    Raises:
        OSError: a file cannot be copied.
    """
    from mission.world.world_reader import read_world

    given = with_copies(read_world(file).model_dump(mode="json", exclude_unset=True), run_folder)
    write_whole(run_folder / file.name, json.dumps(given, indent=1, ensure_ascii=False).encode())  # JSON is YAML
    return file.name


def _copy(file: Path, run_folder: Path) -> str:
    digest = hashlib.sha256(file.read_bytes()).hexdigest()[:8]
    target = run_folder / FOLDER / digest
    target.mkdir(parents=True, exist_ok=True)
    for path in _with_those_it_names(file):
        copy = target / path.relative_to(file.parent)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
    return f"{FOLDER}/{digest}/{file.name}"


def _with_those_it_names(file: Path) -> Iterator[Path]:
    """A mesh file, and those beside it that it is not whole without: materials, textures, buffers."""
    yield file
    names: list[str] = []
    if file.suffix.lower() in (".obj", ".mtl"):
        names = _NAMED.findall(file.read_text(encoding="utf-8", errors="replace"))
    elif file.suffix.lower() == ".gltf":
        made = json.loads(file.read_text(encoding="utf-8"))
        names = [each.get("uri", "") for key in ("buffers", "images") for each in made.get(key, ())]
    for name in dict.fromkeys(names):
        path = file.parent / name
        if (
            name
            and not name.startswith("data:")
            and path.is_file()
            and path.resolve().is_relative_to(file.parent.resolve())
        ):
            if path.suffix.lower() == ".mtl":
                yield from _with_those_it_names(path)
            else:
                yield path
