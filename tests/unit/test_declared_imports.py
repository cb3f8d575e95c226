"""What the code imports is what pyproject.toml declares, part by part: a plain install, and each extra."""

import ast
import re
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

from mission.console.command_refusal import LEARN_PACKAGES
from tests.documents import PACKAGES as FOLDERS
from tests.documents import ROOT

PACKAGES = [folder for folder in FOLDERS if folder != "bench"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# Where an extra may be imported; everywhere else is what a plain install has.
PLACES = {
    "foxglove": ("mission/foxglove",),
    "viewer": ("mission/view",),
    "worlds": ("mission/view", "mission/world", "sim/world/custom/mesh_files.py"),
    "geo": ("sim/world/custom/heightmap.py",),
    "tune": (
        *("autopilot/control/margins.py", "autopilot/estimator/derive.py"),
        *("autopilot/vehicles/multirotor/tuning.py", "autopilot/vehicles/rover/tuning.py"),
    ),
    "engines": ("sim/engines/quiet_bullet.py", "sim/engines/quiet_jsbsim.py"),
    "gym": ("policies/__init__.py", "policies/tasks"),
    "learn": (
        *("policies/companion", "policies/datasets", "policies/experts", "policies/learn", "policies/offline"),
        "policies/image_layers.py",
        "policies/tracker.py",
        *("policies/mono_depth", "policies/person_detector", "mission/benchmark/any_pilot.py"),
        *("mission/train", "mission/video/rtp_video.py", "mission/video/video_file.py"),
    ),
    "lerobot": ("policies/datasets/exporting_lerobot.py",),
    "test": ("mission/pytest_plugin",),
    "ray": ("mission/campaign/workers/ray_cluster.py", "mission/dataset/ray_collectors.py"),
    "dev": ("tests",),
    "bench": ("bench",),
    "mutants": ("tests/mutants",),
}
OWN_ENVIRONMENTS = ("tests/mavproxy", "tests/mavsdk3", "tests/dronekit", "bench/offline_d3rlpy/theirs.py")
# Distributions whose module has another name.
NAMED_OTHERWISE = {
    "cosmic_ray": "cosmic-ray",
    "PIL": "pillow",
    "cv2": "opencv-python-headless",
    "pydantic_core": "pydantic",  # its own half
    "serial": "pyserial",
    "stable_baselines3": "stable-baselines3",
    "warp": "warp-lang",
    "foxglove": "foxglove-sdk",
    "google": "protobuf",
    "yaml": "pyyaml",
}
# Declared because they are run, not imported.
COMMANDS = {"import-linter", "mypy", "pre-commit", "pytest-xdist", "ruff", "tensorboard"}


def name_of(requirement: str) -> str:
    return re.match(r"[\w-]+", requirement)[0].lower()


def declared(extra: str) -> set[str]:
    """The distributions of an extra, and of those that it includes."""
    found = set()
    for requirement in PROJECT["optional-dependencies"][extra]:
        if name_of(requirement) == "honeyguide":
            found.update(*map(declared, re.search(r"\[(.*)\]", requirement)[1].split(",")))
        else:
            found.add(name_of(requirement))
    return found


PLAIN = set(map(name_of, PROJECT["dependencies"]))


@cache
def imported(path: Path) -> set[str]:
    """The distributions that a file imports, wherever in it."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.append(node.module)
    modules = {name.split(".")[0] for name in names}
    own = {*PACKAGES, "bench", "docs", "tests", "pytest_honeyguide"} | {
        sibling.stem for sibling in path.parent.glob("*.py")
    }
    return {NAMED_OTHERWISE.get(each, each).lower() for each in modules - own - sys.stdlib_module_names}


def files(*folders: str) -> list[Path]:
    found = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    return [path for path in found if not path.relative_to(ROOT).as_posix().startswith(OWN_ENVIRONMENTS)]


def extras_at(path: Path) -> list[str]:
    place = path.relative_to(ROOT).as_posix()
    return [extra for extra, places in PLACES.items() if any(f"{place}/".startswith(f"{each}/") for each in places)]


def test_what_is_imported_is_declared_for_the_part_that_imports_it():
    undeclared = {}
    for path in files(*PACKAGES, "bench", "tests"):
        missing = imported(path) - PLAIN.union(*map(declared, extras_at(path)))
        if missing:
            undeclared[path.relative_to(ROOT).as_posix()] = sorted(missing)
    assert not undeclared


@pytest.mark.parametrize("extra", [None, *PLACES])
def test_what_is_declared_is_imported(extra):
    own = PLAIN if extra is None else {name_of(each) for each in PROJECT["optional-dependencies"][extra]}
    folders = PACKAGES if extra is None else [place for place in PLACES[extra] if (ROOT / place).is_dir()]
    paths = files(*folders) + [ROOT / place for place in PLACES.get(extra, ()) if place.endswith(".py")]
    assert own - {"honeyguide"} - COMMANDS <= set().union(*map(imported, paths))


@pytest.mark.parametrize("package", PACKAGES)
def test_each_package_says_that_it_is_typed(package):
    assert (ROOT / package / "py.typed").exists()
    assert "py.typed" in tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["*"]


def test_a_missing_package_of_the_extra_learn_is_refused_in_a_sentence():
    assert declared("learn") <= {NAMED_OTHERWISE.get(module, module) for module in LEARN_PACKAGES}
