"""The documentation tells the truth: folder maps, links, commands, examples and the parameter list."""

import json
import re
import shlex
import socket

import pytest
from typer import Context
from typer.main import get_command
from typer.testing import CliRunner

from bench.figures import RESULTS, with_figures
from common.airframe import load_airframe
from docs.generate import generated_pages
from mission.cli import app
from mission.flight_config import FlightConfig, flight_parameters
from policies.learn.config.command_line import flags
from tests.documents import PACKAGES, ROOT, anchors, blocks, commands, links, pages, references

PAGES = {page.relative_to(ROOT).as_posix(): page for page in pages()}
HONEYGUIDE = ".venv/bin/honeyguide"
# Run by continuous integration, by other tests, or too long for a test: what they are is checked, not run.
NOT_RUN_HERE = {
    "make fly": "the commands with ARGS run it",
    "make mission": "the commands with ARGS run it",
    "make test": "this is it",
    "make reproduce-cars": "hours of training; docs/results/cars.md is what it writes",
    "make reproduce-navigate": "half an hour of training; docs/results/navigate.md is what it writes",
    "make reproduce-follow": "hours of training; docs/results/follow.md is what it writes",
    "make reproduce-offline": "hours of flights and training; docs/results/offline.md is what it writes",
    **{
        f'make reproduce-offline ARGS="--story {story}"': f"half an hour; docs/results/{page}.md is what it writes"
        for story, page in (("follow", "offline"), ("park", "offline-parking"), ("navigate", "offline-navigate"))
    },
    "python -m bench.offline.estimates": "minutes; docs/results/offline-estimates.md is what it writes",
    ".venv/bin/python -m bench.offline_d3rlpy.alike --d3rlpy-python d3rlpy-env/bin/python": "d3rlpy",
    ".venv/bin/python -m bench.offline_d3rlpy --d3rlpy-python d3rlpy-env/bin/python": "hours, and d3rlpy",
    "python3 -m venv d3rlpy-env && d3rlpy-env/bin/pip install torch==2.13.0 d3rlpy": "its environment",
    f"{HONEYGUIDE} follow --policy follow-me": "flies what the line before trains for a quarter of an hour",
    "make train-demo": "minutes of training; tests/unit/mission/train runs its commands",
    'make tune ARGS="--airframe common/airframes/f450.toml"': "tests/unit/autopilot/test_tuning.py",
    ".venv/bin/python -m autopilot.estimator.derive": "tests/unit/autopilot/estimator/test_derive.py",
}

TESTS_THEMSELVES = {"docs/how-to/pytest.md"}  # run by tests/unit/mission/pytest_plugin/test_docs_example.py
RUN_BY_OTHERS = (
    "pipx install ",
    "pip wheel ",
    "docker ",  # tests/system/commands/test_installing.py builds the wheel and flies from it
    f"{HONEYGUIDE} picture ",  # tests/unit/mission/video/test_image_command.py
    *(
        f"{HONEYGUIDE} {name} " for name in ("demonstrate", "play", "drive")
    ),  # tests/unit/mission/train/test_task_commands.py
    f"{HONEYGUIDE} world ",  # tests/unit/mission/world
    f"{HONEYGUIDE} fly --world ",  # tests/unit/mission/world/test_worked_example.py
    f"{HONEYGUIDE} mcap ",  # tests/system/commands/test_foxglove.py
    "pytest ",  # tests/unit/mission/pytest_plugin
    f"{HONEYGUIDE} replay ",  # tests/unit/mission/view/test_replay.py
    f"{HONEYGUIDE} review ",  # tests/unit/mission/review/test_review_session.py
    f"{HONEYGUIDE} benchmark ",  # tests/unit/mission/follow/benchmark/test_benchmark.py
    f"{HONEYGUIDE} test ",  # tests/unit/mission/scenario/test_command.py, tests/system/scenarios
    f"{HONEYGUIDE} campaign ",  # tests/system/campaigns
    f"{HONEYGUIDE} dataset ",  # tests/system/companion/test_recorded_flight.py, tests/unit/mission/dataset
    f"{HONEYGUIDE} companion ",  # tests/system/companion/test_companion.py
    *(f"{HONEYGUIDE} {name} " for name in ("train", "eval", "export", "card")),  # tests/unit/mission/train
)


def modules():
    return [
        path.relative_to(ROOT)
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        if path.name not in {"__init__.py", "__main__.py"}
    ]


def is_named(module):
    """Whether the README of the module's folder, or of one above it, names it by its path from there."""
    for folder in module.parents[:-1]:
        readme = ROOT / folder / "README.md"
        if readme.exists() and f"`{module.relative_to(folder).as_posix()}`" in readme.read_text(encoding="utf-8"):
            return True
    return False


def test_every_module_is_named_in_a_readme():
    assert [module.as_posix() for module in modules() if not is_named(module)] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_readme_names_no_file_that_is_not_there(package):
    for readme in (ROOT / package).rglob("README.md"):
        first_column = re.findall(r"^\| (`[^|]*`) \|", readme.read_text(encoding="utf-8"), re.MULTILINE)
        for name in re.findall(r"`([\w/]+\.py)`", " ".join(first_column)):
            assert (readme.parent / name).exists(), f"{readme.relative_to(ROOT)}: {name}"


@pytest.mark.parametrize("name", PAGES)
def test_links_lead_somewhere(name):
    page = PAGES[name]
    for target, anchor in links(page):
        there = (page.parent / target).resolve() if target else page
        assert there.exists(), target
        assert there.is_relative_to(ROOT), target
        if anchor:
            assert anchor in anchors(there), f"{target}#{anchor}"


@pytest.mark.parametrize("name", PAGES)
def test_files_that_a_page_names_by_their_path_exist(name):
    """NAME and the like stand for a file that is to be written."""
    named = re.findall(
        rf"`((?:{'|'.join((*PACKAGES, 'tests', 'docs'))})/[\w/.-]+\.\w+)`", PAGES[name].read_text("utf-8")
    )
    assert [path for path in named if not (ROOT / path).exists() and not re.search("[A-Z]{4}", path)] == []


def test_tests_that_are_named_exist():
    for name, page in PAGES.items():
        for test, target in re.findall(r"\[(test_\w+)\]\(([^)]+\.py)\)", page.read_text(encoding="utf-8")):
            source = (page.parent / target).read_text(encoding="utf-8")
            assert re.search(rf"^def {test}\(", source, re.MULTILINE), f"{name}: {test}"


def test_readme_can_be_read_at_once():
    assert len(PAGES["README.md"].read_text(encoding="utf-8").split()) < 900


def test_readme_says_how_fast_training_is_beside_stable_baselines3_as_it_was_measured():
    values = {row["name"]: row["value"] for row in json.loads(RESULTS.read_text())}
    ours = [value for name, value in values.items() if name.endswith("settings, ours over Stable-Baselines3")]
    alone = [value for name, value in values.items() if name.endswith("torch alone over the loop")]
    assert (len(ours), len(alone)) == (2, 2)
    text = " ".join(PAGES["README.md"].read_text(encoding="utf-8").split())
    assert f"{min(ours):.1f} to {max(ours):.0f} times as fast as Stable-Baselines3's and not 3 times" in text
    assert f"since {100 * min(alone):.0f} to {100 * max(alone):.0f} % of its time" in text


def test_benchmarks_are_those_that_were_measured():
    page, rows = PAGES["docs/reference/benchmarks.md"].read_text(encoding="utf-8"), json.loads(RESULTS.read_text())
    assert with_figures(page, rows) == page, "python -m bench.figures"


def test_version_is_the_same_everywhere():
    (version,) = re.findall(
        r'^version = "([^"]+)"$', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE
    )
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {version}\n" in citation
    (date,) = re.findall(r'date-released: "(.+)"', citation)
    assert f"## [{version}] - {date}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_files_that_recipes_name_exist():
    for path in files_of_recipes():
        assert path.exists(), path


def test_the_range_finder_is_in_every_file_that_the_sensor_recipe_names():
    for path in files_of_recipes("A sensor"):
        assert re.search(r"range|DISTANCE_SENSOR", path.read_text(encoding="utf-8"), re.IGNORECASE), path


def files_of_recipes(heading="Recipes"):
    """Files that a part of CONTRIBUTING.md names; NAME is one to be added, a bare name lies beside the last."""
    text = PAGES["CONTRIBUTING.md"].read_text(encoding="utf-8")
    end = "\n## " if heading == "Recipes" else "\n### "
    for row in text.partition(f"# {heading}\n")[2].partition(end)[0].splitlines():
        folder = ROOT
        for name in re.findall(r"`([\w./-]+\.(?:py|toml|yaml))`", row):
            path = ROOT / name if "/" in name else folder / name
            folder = path.parent
            if "NAME" not in name:
                yield path


def flight_arguments(line, target, command):
    """The arguments of a command of `honeyguide` in a command line; None if it is another command."""
    words = shlex.split(line)
    if words[:2] == ["make", target] and len(words) == 3 and words[2].startswith("ARGS="):
        return shlex.split(words[2].removeprefix("ARGS="))
    if words[:2] == [HONEYGUIDE, command]:
        return words[2:]
    return None


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.mark.parametrize(("page", "line"), commands())
def test_command_works(page, line, tmp_path, monkeypatch):
    if line in NOT_RUN_HERE or line.startswith(RUN_BY_OTHERS):
        return
    follow_arguments = flight_arguments(line, "fly", "follow")
    if follow_arguments is not None:
        shortened = ["--speed", "max", "--seconds", "2", "--no-mp4", "--run-folder", str(tmp_path / "flight")]
        result = CliRunner().invoke(app, ["follow", *follow_arguments, *shortened])
        assert result.exit_code in {0, 1}, result.output  # 1: a script may fail to follow
        assert (tmp_path / "flight" / "summary.json").exists()
        return
    park_arguments = [] if line == "make park" else flight_arguments(line, "park", "park")
    if park_arguments is not None:
        shortened = ["--speed", "max", "--run-folder", str(tmp_path / "flight")]
        result = CliRunner().invoke(app, ["park", *park_arguments, *shortened])
        assert result.exit_code in {0, 1}, result.output  # 1: a policy may fail to park
        assert (tmp_path / "flight" / "summary.json").exists()
        return
    arguments = flight_arguments(line, "mission", "fly")
    assert arguments is not None, f"{page}: nobody runs this: {line}"
    monkeypatch.chdir(ROOT)
    is_whole = {"--once", "max"} <= set(arguments) and "--engine" not in arguments  # theirs: test_engine_missions
    shortened = [] if is_whole else ["--speed", "max", "--seconds", "5"]  # the last one of an option counts
    if "--view" in arguments:
        shortened += ["--view-port", str(free_port())]
    if "--foxglove" in arguments:
        shortened += ["--foxglove-port", str(free_port())]
    result = CliRunner().invoke(app, ["fly", *arguments, *shortened, "--run-folder", str(tmp_path / "flight")])
    is_idle = "--idle" in arguments
    assert result.exit_code == (0 if is_whole or is_idle else 1), result.output  # 1: shortened before its end
    assert (tmp_path / "flight" / "summary.json").exists()


def test_make_targets_that_are_shown_exist():
    targets = set(re.findall(r"^([a-z0-9-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    for page in PAGES.values():
        shown = re.findall(r"`make ([a-z0-9-]+)", page.read_text(encoding="utf-8"))
        assert set(shown) <= targets, page


@pytest.mark.parametrize(
    "name", [name for name, page in PAGES.items() if blocks(page, "python") and name not in TESTS_THEMSELVES]
)
def test_examples_run(name, tmp_path, monkeypatch):
    """The blocks of a page, in order, as one program."""
    monkeypatch.chdir(tmp_path)
    program = "\n".join(blocks(PAGES[name], "python"))
    exec(compile(program, name, "exec"), {"__name__": name})


def test_tests_that_are_named_for_clients_exist():
    page = PAGES["docs/how-to/clients.md"]
    files = {name: (page.parent / target).read_text(encoding="utf-8") for name, target in references(page).items()}
    rows = [line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    named = [(test, re.findall(r"\[([\w-]+)\]", row)) for row in rows for test in re.findall(r"`(test_\w+)`", row)]
    assert len(named) > 20
    for test, places in named:
        assert any(f"def {test}(" in files[place] for place in places), test


def test_reference_links_are_defined_and_used():
    for page in PAGES.values():
        text = page.read_text(encoding="utf-8")
        used = set(re.findall(r"\[([\w-]+)\](?![:(\w])", re.sub(r"`[^`]*`", "", text)))
        for name in references(page):
            assert name in used, f"{page}: [{name}]"


def test_generated_pages_are_current():
    for path, text in generated_pages().items():
        assert path.read_text(encoding="utf-8") == text, "python -m docs.generate"


def test_the_page_of_parameters_has_every_one_that_a_vehicle_has():
    """As the vehicle lists them over MAVLink, in both dialects."""
    page = PAGES["docs/reference/parameters.md"].read_text(encoding="utf-8").partition("## Names in the")[0]
    described = set(re.findall(r"^\| (\w+) \|", page, re.MULTILINE))
    for dialect in ("px4", "ardupilot"):
        config = FlightConfig(dialect=dialect)
        assert set(flight_parameters(config, load_airframe(config.airframe)).declarations) <= described


SECTIONS_OF_COMMANDS = {  # the page, and the heading under which its options are described, if there are several
    "fly": ("docs/how-to/flying.md", "Options"),
    "follow": ("docs/how-to/follow-me.md", "Options of follow"),
    "replay": ("docs/how-to/flying.md", "Looking at a run again"),
    "review": ("docs/how-to/review.md", "Reviewing a flight"),
    "companion": ("docs/how-to/companion.md", "The companion computer"),
    "park": ("docs/how-to/rover.md", "Park it"),
    "test": ("docs/how-to/scenarios.md", "Missions as tests"),
    "campaign": ("docs/how-to/campaigns.md", "Campaigns"),
    "play": ("docs/how-to/demonstrations.md", "Watch"),
    "drive": ("docs/how-to/demonstrations.md", "Drive"),
    "demonstrate": ("docs/how-to/demonstrations.md", "Record"),
}


@pytest.mark.parametrize("name", SECTIONS_OF_COMMANDS)
def test_options_are_all_described(name):
    page, heading = SECTIONS_OF_COMMANDS[name]
    text = PAGES[page].read_text(encoding="utf-8")
    if heading:
        text = text.partition(f"# {heading}\n")[2].partition("\n## ")[0]
    described = set(re.findall(r"^\| `(--[\w-]+)", text, re.MULTILINE))
    command = get_command(app).commands[name]
    options = [parameter for parameter in command.get_params(Context(command)) if parameter.param_type_name == "option"]
    assert described == {f"--{option.name.replace('_', '-')}" for option in options if option.name != "help"}


def test_options_of_train_are_all_described():
    page = PAGES["docs/how-to/training.md"].read_text(encoding="utf-8").partition("## Options of train")[2]
    described = set(re.findall(r"^\| `(--[\w-]+)", page, re.MULTILINE))
    train = next(command for command in app.registered_commands if command.callback.__name__ == "train")
    arguments = {"return", "context", "task_or_config"}
    names = {f"--{name.replace('_', '-')}" for name in train.callback.__annotations__ if name not in arguments}
    assert described == names
    assert {flag.option for flag in flags()} <= names
