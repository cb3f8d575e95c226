"""The wheel holds all that a flight needs, and a plain install of it flies, in a bare environment too."""

import os
import subprocess
import sys
import venv

import pytest

from tests.documents import ROOT, blocks

PIP = ["-m", "pip", "--quiet", "--disable-pip-version-check"]
# Where what an extra brings is imported, when its commands are run.
OF_EXTRAS = (
    *("policies.", "mission.view.", "mission.train.", "mission.follow.", "mission.park.park_session"),
    *("mission.benchmark.", "mission.pytest_plugin.", "mission.foxglove."),
    *("mission.world.world_export", "mission.world.world_shapes", "mission.dataset.build", "mission.dataset.collect"),
    *("mission.dataset.judge", "mission.dataset.process_collectors", "mission.dataset.ray_collectors"),
    *("mission.dataset.shards", "mission.dataset.show", "mission.dataset.write_episodes"),
    *("mission.scenario.flight.companions", "mission.scenario.flight.policy_steps"),
    "mission.scenario.judging.policy_figures",
    *("sim.engines.bullet", "sim.engines.jsbsim_", "sim.engines.quiet_"),
    *("autopilot.tuning", "autopilot.control.margins", "autopilot.estimator.derive"),
    *("autopilot.vehicles.multirotor.tuning", "autopilot.vehicles.rover.tuning"),
)
IMPORT_ALL = """
import importlib, pkgutil
for package in ("common", "autopilot", "sim", "policies", "mission"):
    for module in pkgutil.walk_packages(importlib.import_module(package).__path__, package + "."):
        try:
            importlib.import_module(module.name)
        except ModuleNotFoundError:
            print(module.name)
"""


def wheel_in(folder):
    subprocess.run([sys.executable, *PIP, "wheel", "--no-deps", "--wheel-dir", folder, ROOT], check=True)
    (wheel,) = folder.glob("honeyguide-*.whl")
    return wheel


def write_examples(folder):
    """The files of the pages on scenarios and on pytest, as they stand there, under the names that they give."""
    for page, language in (("scenarios", "yaml"), ("pytest", "python")):
        text = blocks(ROOT / "docs" / "how-to" / f"{page}.md", language)[0]
        (folder / text.partition("\n")[0].removeprefix("# ")).write_text(text)


@pytest.mark.slow
def test_a_bare_environment_flies_and_imports_all_but_what_extras_bring(tmp_path):
    """Downloads what a plain install needs, or takes it from pip's cache."""
    venv.create(tmp_path / "bare", with_pip=True)
    python = tmp_path / "bare" / "bin" / "python"
    constraints = ["--constraint", ROOT / "constraints.txt"]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    subprocess.run([python, *PIP, "install", *constraints, wheel_in(tmp_path)], check=True, env=environment)

    def run(*command):
        return subprocess.run(
            command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300
        )

    imports = run(python, "-c", IMPORT_ALL)
    assert imports.returncode == 0, imports.stderr
    left = [module for module in imports.stdout.split() if not module.startswith(OF_EXTRAS)]
    assert not left, " ".join(left)
    arguments = ("fly", "--once", "--speed", "max", "--seconds", "5", "--run-folder", "flight")
    flight = run(python.with_name("honeyguide"), *arguments)
    assert flight.returncode == 1, flight.stderr  # it ended before its mission
    assert "mission not finished" in flight.stdout
    assert (tmp_path / "flight" / "flight.ulg").stat().st_size > 100_000
    write_examples(tmp_path)
    tested = run(python.with_name("honeyguide"), "test", "delivery.scenario.yaml")
    assert tested.returncode == 0, tested.stdout + tested.stderr
    assert "2 of 2 passed" in tested.stdout
    subprocess.run([python, *PIP, "install", *constraints, "pytest"], check=True, env=environment)
    (tmp_path / "pytest.ini").write_text("[pytest]\nfilterwarnings = error\n")
    flown = run(python.with_name("pytest"), "test_delivery.py", "delivery.scenario.yaml")
    assert flown.returncode == 0, flown.stdout + flown.stderr
    assert "5 passed" in flown.stdout
    refused = run(python.with_name("honeyguide"), "fly", "--engine", "pybullet")
    assert refused.returncode == 2, refused.stderr
    assert "the extra 'engines'" in refused.stderr
    needing = (
        *(("companion", "--policy", "scripted"), ("train", "Parking1"), ("play", "Parking1")),
        ("benchmark", "park", "--policy", "parking1"),
        ("dataset", "collect", "Hover", "--policy", "expert", "-o", "hovers"),
    )
    for needs_extra in needing:
        refused = run(python.with_name("honeyguide"), *needs_extra)
        assert refused.returncode == 2, refused.stderr
        assert "the extra 'learn'" in refused.stderr


@pytest.mark.slow
def test_a_flight_from_the_wheel(tmp_path):
    """Another folder than the clone's, and nothing of the clone on the path."""
    wheel = wheel_in(tmp_path)
    site = tmp_path / "site"
    subprocess.run([sys.executable, *PIP, "install", "--no-deps", "--target", site, wheel], check=True)
    program = "import mission, sys; print(mission.__file__); from mission.cli import main; main()"
    result = subprocess.run(
        [sys.executable, "-P", "-c", program, "fly", "--once", "--speed", "max", "--run-folder", tmp_path / "flight"],
        env={**os.environ, "PYTHONPATH": str(site)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith(str(site))
    assert "mission completed" in result.stdout
