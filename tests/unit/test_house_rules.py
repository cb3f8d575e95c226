"""Ceilings of the house: how many files lie in a folder, how long files and functions are, where rotors are spoken of.

What is above a ceiling is named here with its size of the day it was named: it may shrink, not grow, and a name whose
file keeps the rule must go.
"""

import ast
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("common", "autopilot", "sim", "policies", "mission")
SIBLINGS_MAX, FILE_LINES_MAX, FUNCTION_LINES_MAX = 20, 400, 60

LONG_FILES = {"autopilot/estimator/generated.py": 638}  # written by derive.py
LONG_FUNCTIONS = {
    "autopilot/estimator/generated.py predict_covariance": 379,
    "autopilot/estimator/generated.py mag_products": 61,
    "autopilot/estimator/generated.py drag_products": 80,
}

ROTOR_WORDS = re.compile(r"(?i:rotor|collective|hover_thrust)|\b(MC|MPC|LNDMC|NAV_MC|FD_ACT)_")  # and its parameters
ROTOR_FOLDERS = ("autopilot/vehicles/multirotor/", "sim/bodies/", "common/airframes/")
SPEAK_OF_ROTORS = {
    "common/airframe.py": "names the class of airframe files that name none",
    "autopilot/tuning.py": "names the classes whose gains are designed",
    "autopilot/vehicles/default_class.py": "names the class of airframe files that name none",
    "mission/boards/board_options.py": "names the classes that each autopilot flies",
    "mission/boards/betaflight_flight.py": "Betaflight flies multirotors alone",
    "mission/boards/betaflight_run.py": "the same",
    "mission/boards/betaflight_setup.py": "what it has to know of one",
    "mission/boards/px4_params.py": "what PX4 has to know of a multirotor",
    "mission/boards/vehicle_params.py": "what an outside autopilot has to know of a multirotor",
    "mission/plan/plan_file.py": "MAVLink's name of a vehicle type, in QGroundControl's files",
    "mission/view/shapes.py": "the shape of a multirotor",
    "mission/review/summary.py": "MAVLink's names of vehicle types, in logs of others",
    "mission/console/option_checks.py": "which engine moves what",
    "policies/tasks/follow_me/tracked/quick_vehicle.py": "the parameters of a multirotor that follows",
    "sim/engines/bullet.py": "which classes Bullet moves",
    "sim/boards/betaflight.py": "Betaflight flies multirotors alone",
    "sim/boards/betaflight_sticks.py": "its sticks",
    "sim/boards/betaflight_wire.py": "its motors",
    "sim/engines/bullet_multirotor.py": "a multirotor for Bullet",
    "sim/engines/jsbsim_engine.py": "JSBSim moves multirotors",
    "sim/engines/midstep.py": "multirotors, whose rotors these engines do not know",
}
"""Files outside of the multirotor's folders that speak of rotors, and why."""

HOUSE_WORDS = {
    "share": "fraction",
    "shares": "fractions",
    "picture": "image",
    "pictures": "images",
    "told": "reported",
    "shelf": "catalogue",
}
HOUSE_NAMES = {
    "owner_stop_share": "a task's parameter, in configurations and policies",
    "owner_graze_share": "a task's parameter",
    "storey_2_share": "a task's parameter",
    "start_elsewhere_share": "a task's parameter",
    "show_share_button": "viser's",
    "request_share_url": "viser's",
    "picture": "a command of the command line",
}
"""Names that keep a word of the house, and why."""


def sources(roots=PACKAGES):
    return [path for root in roots for path in sorted((ROOT / root).rglob("*.py"))]


def name(path):
    return path.relative_to(ROOT).as_posix()


def functions(path):
    """Names and lengths of functions and methods, with the class before the name."""
    tree = ast.parse(path.read_text())
    owners = {id(each): node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef) for each in node.body}
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            owner = f"{owners[id(node)]}." if id(node) in owners else ""
            yield f"{name(path)} {owner}{node.name}", node.end_lineno - node.lineno + 1


def judged(sizes, ceiling, exceptions):
    """What is above the ceiling, or above what was conceded; and concessions that nothing needs."""
    wrong = [f"{key}: {size}" for key, size in sizes.items() if size > max(exceptions.get(key, 0), ceiling)]
    return wrong + [f"{key}: no exception any more" for key in exceptions if sizes.get(key, 0) <= ceiling]


def test_no_folder_is_crowded():
    folders = {path.parent for path in sources((*PACKAGES, "bench", "docs", "tests"))}
    counts = {name(each): sum(path.name != "__init__.py" for path in each.glob("*.py")) for each in folders}
    assert not judged(counts, SIBLINGS_MAX, {})


def test_no_file_is_long():
    assert not judged({name(path): path.read_text().count("\n") for path in sources()}, FILE_LINES_MAX, LONG_FILES)


def test_no_function_is_long():
    sizes = {key: size for path in sources() for key, size in functions(path)}
    assert not judged(sizes, FUNCTION_LINES_MAX, LONG_FUNCTIONS)


def test_only_the_multirotors_files_speak_of_rotors():
    others = (path for path in sources() if not name(path).startswith(ROTOR_FOLDERS))
    assert {name(path) for path in others if ROTOR_WORDS.search(path.read_text())} == set(SPEAK_OF_ROTORS)


def test_names_use_the_words_of_the_field():
    """`docs/reference/glossary.md` has what is meant; here are the words that the field does not use."""
    found = set()
    for path in sources():
        with tokenize.open(path) as file:
            names = {token.string for token in tokenize.generate_tokens(file.readline) if token.type == tokenize.NAME}
        for each in names - HOUSE_NAMES.keys():
            words = re.findall(r"[a-z]+", re.sub(r"([A-Z][a-z])", r"_\1", each).lower())
            found |= {f"{name(path)}: {each}: {HOUSE_WORDS[word]}" for word in words if word in HOUSE_WORDS}
    assert not found


@pytest.mark.parametrize(("size", "reported"), [(20, []), (21, ["a: 21"]), (25, ["a: 25"])])
def test_a_ceiling_is_a_ceiling(size, reported):
    assert judged({"a": size}, SIBLINGS_MAX, {}) == reported
    assert judged({"a": 19}, SIBLINGS_MAX, {"a": 25}) == ["a: no exception any more"]
