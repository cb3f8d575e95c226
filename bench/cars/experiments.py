"""The rows of docs/results/cars.md, in the order of the page."""

from dataclasses import dataclass

from bench.cars.experiment import NEW_SPOTS, Experiment, Judged

VARIANTS = ("A0", "A1", "A2", "A3", "A4")
_REPORTED = (
    "reward ≤ 0.025, no improvement",
    "slow upward trend",
    "reward 0.25 to 0.3, still rising",
    "reliably reaches",
    "solves it, slower to start than A3",
)


@dataclass(frozen=True, slots=True)
class Picture:
    """Curves of several experiments in one figure."""

    name: str
    title: str
    runs: dict[str, str]  # label to experiment
    value: str = "success"
    over: str = "wall_s"


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the page."""

    title: str
    words: str
    experiments: tuple[Experiment, ...]
    pictures: tuple[Picture, ...] = ()


ROLLER_BALL = Experiment(
    "roller-ball", "RollerBall", "roller-ball", document="~100 % after 20-30k steps", target=0.99, limit_s=10.0
)

REACH = Experiment(
    "reach-target",
    "ReachTarget, ours",
    "reach-target",
    judged=(Judged("reached within 40 s", {"split": "test"}),),
    target=0.99,
    limit_s=120.0,
)

REACH_CURVES = tuple(
    Experiment(
        f"reach-{variant.lower()}-{width}",
        f"{variant}, {network}",
        f"reach-target-document{'' if width == 512 else '-small'}",
        seeds=1 if width == 512 else 3,
        settings={"variant": k},
        document=_REPORTED[k],
    )
    for width, network in ((512, "3 x 512"), (128, "2 x 128"))
    for k, variant in enumerate(VARIANTS)
)

PARKING1 = Experiment(
    "parking1", "Parking 1, PPO", "parking1", judged=(NEW_SPOTS,), document="13 %, 12 h", target=0.99, limit_s=120.0
)
PARKING1_GAIL = Experiment(
    "parking1-gail",
    "Parking 1, PPO + GAIL",
    "parking1-gail",
    judged=(NEW_SPOTS,),
    document="92 %, 12 h",
    target=0.99,
    limit_s=120.0,
)
PARKING2 = Experiment(
    "parking2",
    "Parking 2",
    "parking2",
    judged=(
        Judged("training spots", {"split": "train"}),
        Judged("new spots, storey 1", {"split": "test", "storey": "1"}),
        Judged("new spots, storey 2", {"split": "test", "storey": "2"}),
    ),
    document="32.8 / 47.2 / 22.8 %, 4 to 6 days",
    target=0.97,
    limit_s=600.0,
)
PARKING1_IMPROVED = Experiment(
    "parking1-improved",
    "Parking 1, improved",
    "parking1-improved",
    judged=(NEW_SPOTS,),
    document="not attempted",
    target=0.95,
)
PARKING2_IMPROVED = Experiment(
    "parking2-improved",
    "Parking 2, improved",
    "parking2-improved",
    judged=(NEW_SPOTS,),
    document="not attempted",
    target=0.95,
)

SECTIONS = (
    Section(
        "The headline",
        "Our recipes (`policies/recipes/`), one core each. New spots are cells of the arena that training never used.",
        (ROLLER_BALL, REACH, PARKING1, PARKING1_GAIL, PARKING2, PARKING1_IMPROVED, PARKING2_IMPROVED),
        (
            Picture(
                "parking1", "Parking 1: from nothing to parked", {"PPO": "parking1", "PPO + GAIL": "parking1-gail"}
            ),
            Picture("parking2", "Parking 2: two storeys, portals, moving obstacles", {"PPO": "parking2"}),
            Picture(
                "improved",
                "Random starts, goals and obstacles; pose and speed count",
                {"Parking 1": "parking1-improved", "Parking 2": "parking2-improved"},
            ),
        ),
    ),
    Section(
        "Learning to Drive: five variants",
        "The document's settings, 2 million steps each: 16 areas, PPO in ML-Agents' form. A4 has the sparse reward.",
        REACH_CURVES,
        (
            Picture(
                "reach-target-512",
                "Reach target, the document's settings (3 x 512)",
                {variant: f"reach-{variant.lower()}-512" for variant in VARIANTS},
                over="steps",
            ),
            Picture(
                "reach-target-128",
                "Reach target, a smaller network (2 x 128), mean of three seeds",
                {variant: f"reach-{variant.lower()}-128" for variant in VARIANTS},
                over="steps",
            ),
        ),
    ),
)

EXPERIMENTS = {experiment.name: experiment for section in SECTIONS for experiment in section.experiments}
