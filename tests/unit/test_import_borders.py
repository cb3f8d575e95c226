"""Who imports whom: no circles, and what a process has loaded is what it needs."""

import json
import subprocess
import sys
import tomllib
from graphlib import TopologicalSorter

import grimp
import pytest

from tests.documents import ROOT

PACKAGES = ("common", "autopilot", "sim", "policies", "mission")
EXTRAS = ("av", "gymnasium", "minari", "pygame", "scipy", "torch", "viser", "websockets")


def loaded(program: str) -> set[str]:
    """The modules of a fresh interpreter after a program; its output is left out."""
    shown = f"{program}\nimport sys, json; print(json.dumps(sorted(sys.modules)))"
    command = [sys.executable, "-c", shown]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert result.returncode == 0, result.stderr
    return set(json.loads(result.stdout.splitlines()[-1]))


def of_package(modules: set[str], package: str) -> list[str]:
    return sorted(module for module in modules if module.split(".")[0] == package)


def test_no_module_imports_itself_through_others():
    """Imports for type checkers and those inside functions count."""
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    order = TopologicalSorter({module: graph.find_modules_directly_imported_by(module) for module in graph.modules})
    order.prepare()  # raises CycleError, which names a circle


def test_no_contract_excuses_an_import_that_is_not_there():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    excused = [contract for contract in contracts if "ignore_imports" in contract]
    assert excused
    assert {contract.get("unmatched_ignore_imports_alerting") for contract in excused} == {"error"}


@pytest.fixture(scope="module")
def plain_flight(tmp_path_factory) -> set[str]:
    folder = tmp_path_factory.mktemp("plain") / "flight"
    arguments = ["fly", "--idle", "--speed", "max", "--seconds", "0.1", "--run-folder", str(folder)]
    return loaded(f"from mission.cli import app\napp({arguments!r}, standalone_mode=False)")


@pytest.mark.parametrize("unneeded", ["policies", "mission.follow.owner_device", "sim.sensors.fast_camera", *EXTRAS])
def test_a_flight_without_an_owner_imports_no_policies_no_fast_camera_and_no_extra(unneeded, plain_flight):
    assert "mission.flight" in plain_flight
    assert unneeded not in plain_flight


@pytest.fixture(scope="module")
def option_modules() -> set[str]:
    return loaded("import mission.flight_options")


def test_no_command_waits_for_the_options_of_another():
    modules = loaded("from typer.main import get_command\nfrom mission.cli import app\nget_command(app)")
    assert "typer" in modules
    assert "pydantic" not in modules


def test_warp_is_not_imported_to_check_options_that_need_it_not():
    modules = loaded("import mission.console.option_checks")
    assert "mission.plan.plan_file" in modules
    assert not {"numpy", "warp"} & modules


def test_matplotlib_is_not_imported_before_a_flight_ends():
    modules = loaded("import mission.fly_session, mission.fly_loop, mission.kernel_loading, mission.flight")
    assert "sim.rig" in modules
    assert "matplotlib" not in modules


def test_the_companion_imports_nothing_of_the_simulator():
    modules = loaded(
        "from mission.follow.companion_process import load_skill, run_companion\n"
        "for name in ('scripted', 'FollowMe', 'Navigate'):\n"
        "    load_skill(name, 'tcp://127.0.0.1:1', is_ordered_by_goto=True)\n"
    )
    assert "policies.companion.vector_pilot" in modules
    assert not of_package(modules, "sim")


@pytest.mark.parametrize(
    "heavy", ["autopilot.flight_controller", "matplotlib", "mission.flight", "policies", "sim.rig"]
)
def test_options_are_checked_before_anything_heavy_is_imported(heavy, option_modules):
    assert heavy not in option_modules


def test_tasks_are_registered_with_gymnasium_before_their_kernels_are_imported():
    modules = loaded(
        "import gymnasium, policies\ngymnasium.register_envs(policies)\nassert gymnasium.spec('honeyguide/Parking1-v0')"
    )
    assert "policies.tasks.catalogue" in modules
    assert "warp" not in modules


def test_policies_are_there_without_gymnasium():
    modules = loaded("import sys\nsys.modules['gymnasium'] = None\nimport policies.companion.skills.following")
    assert "policies.tasks.follow_me.observe" in modules
