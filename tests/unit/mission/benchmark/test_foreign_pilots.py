"""`honeyguide benchmark` with pilots of anybody's that do something wrong, and with runs that end early."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from onnx import TensorProto, helper, save
from typer.testing import CliRunner

from mission.benchmark import session
from mission.benchmark.any_pilot import CheckedPilot
from mission.benchmark.benchmark import benchmark_of
from mission.benchmark.goal_pilots import goal_pilot
from mission.benchmark.session import BenchmarkOptions, benchmark_session
from mission.cli import app
from mission.follow.benchmark.flights import Outcome
from mission.follow.benchmark.pilots import any_pilot
from policies.companion.pilot import PilotError
from policies.companion.vector_pilot import NavigationPilot
from policies.pretrained.pretrained_policies import pretrained
from policies.tasks.follow_me.observe import EGO

FLOWN = Outcome(3, 0.99, False, False, 1.5, float("nan"), None, None, True, 10.0, 0.5, 5.0, 60.0, "")


class Stands:
    """Follows nobody, and does nothing wrong; owner_hfrd is not said."""

    kind, image_shape = int(EGO), (64, 64, 4)

    def reset(self):
        pass

    def act(self, vector, image):  # noqa: ARG002
        return [0.0, 0.0, 0.0, 0.0]


class IsNotMade(Stands):
    def __init__(self):
        raise FileNotFoundError("weights.pt")


class IsOfNoKind(Stands):
    kind = 2


class TakesOtherImages(Stands):
    image_shape = (48, 64, 4)


class Raises(Stands):
    def act(self, *_):
        raise RuntimeError("out of ideas")


class GivesThree(Stands):
    def act(self, vector, image):  # noqa: ARG002
        return np.zeros(3)


class GivesWhatIsLearnt(Stands):
    def act(self, vector, image):  # noqa: ARG002
        return torch.zeros(4, requires_grad=True)


class IsOfManyKinds(Stands):
    kind = [0]  # noqa: RUF012


class GivesNothing(Stands):
    def act(self, vector, image):
        pass


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("IsNotMade", "no class that can be made without arguments: weights.pt"),
        ("IsOfNoKind", "kind 2: must be one of 0, 1, 3"),
        ("TakesOtherImages", "image_shape (48, 64, 4): must be (64, 64, 4)"),
        ("Raises", "act: RuntimeError: out of ideas"),
        ("GivesThree", "act gives 4 numbers, not 3 in shape (3,)"),
        ("GivesNothing", "act gives 4 numbers, not None"),
        ("GivesWhatIsLearnt", "act gives 4 numbers, not tensor("),
        ("IsOfManyKinds", "kind [0]: must be one of 0, 1, 3"),
    ],
)
def test_a_class_that_cannot_fly_is_refused_in_a_sentence(name, sentence):
    result = CliRunner().invoke(app, ["benchmark", "follow", "--policy", f"{__name__}:{name}", "--condition", "walk"])
    assert result.exit_code == 2
    assert f"{__name__}:{name}: {sentence}" in " ".join(result.stderr.split())


def test_what_is_given_as_a_list_is_an_action():
    pilot = any_pilot(f"{__name__}:Stands")
    assert pilot.act(np.zeros(3, np.float32), np.zeros((64, 64, 4), np.uint8)).dtype == np.float32
    assert pilot.owner_hfrd is None


def test_a_mistake_in_flight_names_what_made_it():
    made = Stands()
    pilot = CheckedPilot(made, "mine", 4, np.zeros(3), np.zeros(1))
    made.act = Raises().act
    with pytest.raises(PilotError, match="mine: act: RuntimeError: out of ideas"):
        pilot.act(np.zeros(3), np.zeros(1))


@pytest.mark.parametrize(
    ("task", "inputs"),
    [
        ("follow", {"vector": (TensorProto.FLOAT, [1, 21]), "image": (TensorProto.UINT8, [1, 64, 64, 4])}),
        ("follow", {"vector": (TensorProto.DOUBLE, [1, 55])}),
        ("navigate", {"vector": (TensorProto.DOUBLE, [1, 138])}),
    ],
)
def test_a_network_of_the_right_shapes_and_other_types_is_refused_before_anything_is_flown(tmp_path, task, inputs):
    path = tmp_path / "policy.onnx"
    taken = [helper.make_tensor_value_info(name, *of) for name, of in inputs.items()]
    given = helper.make_tensor_value_info("action", TensorProto.FLOAT, [1, 4])
    nodes = [
        helper.make_node("Constant", [], ["row"], value_floats=[0.0] * 4),
        helper.make_node("Constant", [], ["shape"], value_ints=[1, 4]),
        helper.make_node("Reshape", ["row", "shape"], ["action"]),
    ]
    graph = helper.make_graph(nodes, "other-types", taken, [given])
    save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)
    result = CliRunner().invoke(app, ["benchmark", task, "--policy", str(path)])
    assert result.exit_code == 2
    assert f"{path}: act: InvalidArgument: " in " ".join(result.stderr.split())
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize(("task", "policy"), [("follow", "follow-me-tracked"), ("park", "drive-park")])
def test_a_file_whose_path_has_a_colon_is_a_file(tmp_path, task, policy):
    path = tmp_path / "2026-01-01T12:30.pt"
    path.write_bytes(pretrained(policy).read_bytes())
    assert benchmark_of(task).load(str(path)) is not None


@pytest.mark.parametrize("stack", [None, "3", 0])
def test_a_stack_that_is_no_count_is_refused(monkeypatch, stack):
    monkeypatch.setattr(Stands, "stack", stack, raising=False)
    with pytest.raises(PilotError, match="must be how many frames it takes"):
        goal_pilot(f"{__name__}:Stands", NavigationPilot, 2)


@pytest.mark.parametrize("inside", ["", "more"])
def test_a_folder_that_cannot_be_made_is_refused_before_anything_is_flown(tmp_path, inside):
    (tmp_path / "file").write_text("something")
    words = ["--policy", "scripted", "--condition", "walk", "--record", str(tmp_path / "record")]
    words += ["--out", str(tmp_path / "file" / inside)]
    result = CliRunner().invoke(app, ["benchmark", "follow", *words])
    assert result.exit_code == 2
    assert "cannot be made" in result.stderr
    assert (tmp_path / "file").read_text() == "something"
    assert not (tmp_path / "record").exists()  # so that the same words, mended, are taken


class Here:
    """A pool of this process alone."""

    def __init__(self, *_):
        pass

    def __enter__(self):
        return SimpleNamespace(map=map)

    def __exit__(self, *_):
        pass


def test_a_run_that_ends_early_keeps_the_conditions_that_were_flown(tmp_path, monkeypatch):
    def flown(flight):
        if flight.condition == "run":
            raise PilotError("tired")
        flights.append((flight.condition, flight.seed))
        return replace(FLOWN, seed=flight.seed)

    flights = []
    monkeypatch.setattr(session, "ProcessPoolExecutor", Here)
    monkeypatch.setattr(session, "_flown", flown)
    with pytest.raises(PilotError, match="tired"):
        benchmark_session(BenchmarkOptions("follow", "scripted", ("walk", "walk", "run"), 2, 1, 3, out=tmp_path))
    assert flights == [("walk", 3), ("walk", 5)]  # once, though it was named twice
    record = json.loads((tmp_path / "flights.json").read_text())
    assert [flown["seed"] for flown in record["flights"]["walk"]] == [3, 5]
    assert list(record["flights"]) == ["walk"]
    assert "standard, walking" in (tmp_path / "table.md").read_text()
