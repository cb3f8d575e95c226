"""A whole run: one behaviour, its environment, and where its files go."""

from pydantic import Field

from policies.learn.config.behavior import Behavior
from policies.learn.config.config_block import Block
from policies.learn.config.environment import EngineSettings, EnvironmentParameter, EnvSettings


class CheckpointSettings(Block):
    """Which run this is, and what it starts from."""

    run_id: str = Field(default="ppo", min_length=1)
    """Name of the run's folder."""
    initialize_from: str | None = None
    """Name of the run whose networks this one starts from."""
    load_model: bool = False
    """Old name of `resume`."""
    resume: bool = False
    """Whether the run of this name goes on where it stopped; beats initialize_from."""
    force: bool = False
    """Whether an existing run of this name is overwritten."""
    train_model: bool = False
    """Accepted; training is what happens without `inference`."""
    inference: bool = False
    """Whether the policy only acts, and nothing is learnt."""
    results_dir: str = "results"
    """Folder of all runs."""


class TorchSettings(Block):
    """Where networks are computed, and by how many processes."""

    device: str | None = None
    """`cpu`, `cuda`, `cuda:0`; none: `cpu`."""
    processes: int = Field(default=1, ge=1, le=64)
    """Processes that divide each minibatch of an offline algorithm among them."""


class RunConfig(Block):
    """Everything a run is configured by."""

    behavior_name: str
    """Key of the behaviour in `behaviors`."""
    behavior: Behavior = Behavior()
    """What is trained, and how."""
    environment_parameters: dict[str, EnvironmentParameter] = Field(default_factory=dict)
    """Numbers of the task by name: each a number, a sampler or a curriculum."""
    env_settings: EnvSettings = EnvSettings()
    """The task, and how many environments."""
    engine_settings: EngineSettings = EngineSettings()
    """Unity's engine; accepted."""
    checkpoint_settings: CheckpointSettings = CheckpointSettings()
    """The run's name, and what it starts from."""
    torch_settings: TorchSettings = TorchSettings()
    """Where networks are computed."""
    debug: bool = False
    """Whether more is logged."""
