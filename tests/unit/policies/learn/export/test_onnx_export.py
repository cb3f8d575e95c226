"""Exported networks do what the policy does, under ML-Agents' names, for any number of rows."""

import json
from dataclasses import replace

import numpy as np
import onnx
import onnxruntime
import pytest
import torch

from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.export.onnx_export import (
    IMAGE_TOLERANCE,
    TOLERANCE,
    ExportError,
    export_policy,
    largest_difference,
    onnx_bytes,
)
from policies.learn.networks.policy import Policy
from policies.learn.networks.vision import LEAST_SIDES
from policies.tasks.layout import Branch, Element, ImageElement, Layout

FRAME = (Element("goal_x", "m", is_goal=True), *(Element(f"e{k}", "1") for k in range(4)))
CONTINUOUS = (Element("steer", "1"), Element("throttle", "1"))
BRANCHES = (Branch("turn", ("none", "left", "right")), Branch("drive", ("stop", "go")))
KINDS = {
    "continuous": (Layout("T", 1, FRAME, continuous=CONTINUOUS), {}),
    "squashed": (Layout("T", 1, FRAME, continuous=CONTINUOUS), {"is_squashed": True}),
    "discrete": (Layout("T", 1, FRAME, branches=BRANCHES[:1]), {}),
    "hybrid": (Layout("T", 1, FRAME, continuous=CONTINUOUS, branches=BRANCHES, stack=2), {}),
}
NETWORKS = {
    "plain": {},
    "normalised": {"normalize": True},
    "recurrent": {"memory": Memory(memory_size=12), "normalize": True},
    "hyper": {"goal_signal": True, "goal_conditioning_type": "hyper", "normalize": True},
}


def make_policy(kind, network, image=None, **more):
    layout, options = KINDS[kind]
    layout = replace(layout, image=image)
    generator = torch.Generator().manual_seed(1)
    settings = NetworkSettings(hidden_units=16, num_layers=2, **NETWORKS[network], **more)
    policy = Policy(layout, settings, generator, **options)
    policy.body.normalize(3.0 + 2.0 * torch.randn(100, layout.observation_size, generator=generator))
    with torch.no_grad():
        for parameter in policy.parameters():  # biases and deviations too are not left at 0
            parameter.add_(0.1 * torch.randn(parameter.shape, generator=generator))
    return policy


def session(policy):
    return onnxruntime.InferenceSession(onnx_bytes(policy))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("network", NETWORKS)
def test_exported_network_does_what_the_policy_does(kind, network):
    policy = make_policy(kind, network)
    assert largest_difference(policy, onnx_bytes(policy)) <= TOLERANCE


IMAGE = ImageElement(40, 36, ("red", "green", "blue", "nearness"))  # of different sides: none is taken for another


@pytest.mark.parametrize("encoder", LEAST_SIDES)
@pytest.mark.parametrize("network", ["normalised", "recurrent", "hyper"])
def test_exported_network_sees_images_as_the_policy_does(encoder, network):
    policy = make_policy("hybrid", network, vis_encode_type=encoder, image=IMAGE)
    content = onnx_bytes(policy)
    assert largest_difference(policy, content, row_count=16) <= IMAGE_TOLERANCE  # of eight decisions each
    inputs = {node.name: node.shape for node in onnxruntime.InferenceSession(content).get_inputs()}
    assert inputs["obs_0"] == ["batch", 4, 40, 36]
    assert inputs["obs_1"] == ["batch", 10]


def test_names_and_shapes_are_those_of_ml_agents():
    run = session(make_policy("hybrid", "recurrent"))
    assert {node.name: node.shape for node in run.get_inputs()} == {
        "obs_0": ["batch", 10],
        "action_masks": ["batch", 5],
        "recurrent_in": ["batch", 1, 12],
    }
    assert {node.name: node.shape for node in run.get_outputs()} == {
        "version_number": [1],
        "memory_size": [1],
        "continuous_actions": ["batch", 2],
        "deterministic_continuous_actions": ["batch", 2],
        "continuous_action_output_shape": [1],
        "discrete_actions": ["batch", 2],
        "deterministic_discrete_actions": ["batch", 2],
        "discrete_action_output_shape": [1, 2],
        "recurrent_out": ["batch", 1, 12],
    }
    plain = session(make_policy("continuous", "plain"))
    assert [node.name for node in plain.get_inputs()] == ["obs_0"]


def test_opset_is_that_of_ml_agents():
    model = onnx.load_from_string(onnx_bytes(make_policy("continuous", "plain")))
    assert [opset.version for opset in model.opset_import] == [9]


def test_layout_is_in_the_metadata():
    policy = make_policy("hybrid", "plain")
    recorded = session(policy).get_modelmeta().custom_metadata_map["layout"]
    assert Layout.from_record(json.loads(recorded)) == policy.layout


def test_masked_choices_are_never_taken():
    run = session(make_policy("hybrid", "plain"))
    observations = np.random.default_rng(0).normal(size=(200, 10)).astype(np.float32)
    masks = np.tile(np.array([0, 1, 0, 1, 0], dtype=np.float32), (200, 1))
    for name in ("discrete_actions", "deterministic_discrete_actions"):
        (chosen,) = run.run([name], {"obs_0": observations, "action_masks": masks})
        assert (chosen == [1, 0]).all()


def test_drawn_actions_spread_as_the_policy_draws_them():
    policy = make_policy("hybrid", "plain")
    rows = np.tile(np.random.default_rng(0).normal(size=(1, 10)).astype(np.float32), (20_000, 1))
    given = {"obs_0": rows, "action_masks": np.ones((20_000, 5), dtype=np.float32)}
    names = ["continuous_actions", "discrete_actions"]
    drawn = dict(zip(names, session(policy).run(names, given), strict=True))
    actions, _ = policy.act(torch.from_numpy(rows), policy.start_memory(20_000), torch.Generator().manual_seed(0))
    ours = policy.bounded(actions).detach().numpy()
    np.testing.assert_allclose(drawn["continuous_actions"].mean(0), ours.mean(0), atol=0.02)
    np.testing.assert_allclose(drawn["continuous_actions"].std(0), ours.std(0), atol=0.02)
    np.testing.assert_allclose(drawn["discrete_actions"].mean(0), actions.branches.numpy().mean(0), atol=0.03)


def test_same_policy_gives_the_same_bytes():
    policy = make_policy("hybrid", "recurrent")
    assert onnx_bytes(policy) == onnx_bytes(policy)


def test_export_that_differs_is_not_written(tmp_path, monkeypatch):
    policy = make_policy("continuous", "plain")
    monkeypatch.setattr("policies.learn.export.onnx_export.TOLERANCE", -1.0)
    with pytest.raises(ExportError, match="differs from the policy by"):
        export_policy(policy, tmp_path / "a.onnx")
    assert list(tmp_path.iterdir()) == []
