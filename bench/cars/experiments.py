"""The rows of docs/results/cars.md, in the order of the page."""

from dataclasses import dataclass, replace

from bench.cars.done_right import HILL, MEMORY, OTHERS, SPARSE
from bench.cars.experiment import NEW_SPOTS, OTHER_DRAWS, PARKING2_SPOTS, VALIDATION, Experiment, Judged
from bench.cars.few_goals import FEW_GOALS, QUARTER_ANYWHERE, QUARTERS

VARIANTS = ("A0", "A1", "A2", "A3", "A4")
_REPORTED = (
    "reward ≤ 0.025, no improvement",
    "slow upward trend",
    "reward 0.25 to 0.3, still rising",
    "reliably reaches",
    "solves it, slower to start than A3",
)


@dataclass(frozen=True, slots=True)
class Image:
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
    images: tuple[Image, ...] = ()
    remarks: str = ""  # under the table
    failures: str = ""  # under the images: a picture that another command makes


ROLLER_BALL = Experiment(
    "roller-ball",
    "RollerBall",
    "roller-ball",
    judged=(Judged("held out"), OTHER_DRAWS),
    document="~100 % after 20-30k steps",
    target=0.99,
    limit_s=10.0,
)

REACH = Experiment(
    "reach-target",
    "ReachTarget, ours",
    "reach-target",
    judged=(
        Judged("target reached in 40 s", {"preset": "as-coded", "split": "test"}),
        replace(VALIDATION, label="validation targets", settings={"preset": "as-coded", "split": "validation"}),
    ),
    target=0.99,
    limit_s=120.0,
)

REACH_CURVES = tuple(
    Experiment(
        f"reach-{variant.lower()}-{width}",
        f"{variant}, {network}",
        f"reach-target-document{'' if width == 512 else '-small'}",
        settings={"variant": k},
        document=_REPORTED[k],
    )
    for width, network in ((512, "3 x 512"), (128, "2 x 128"))
    for k, variant in enumerate(VARIANTS)
)

PARKING1 = Experiment(
    "parking1",
    "Parking 1, PPO",
    "parking1",
    judged=(NEW_SPOTS, VALIDATION),
    document="13 %, 12 h",
    target=0.99,
    limit_s=120.0,
)
PARKING1_GAIL = replace(
    PARKING1, name="parking1-gail", title="Parking 1, PPO + GAIL", recipe="parking1-gail", document="92 %, 12 h"
)
PARKING2 = Experiment(
    "parking2",
    "Parking 2",
    "parking2",
    judged=(*PARKING2_SPOTS, VALIDATION),
    document="32.8 / 47.2 / 22.8 %, 4 to 6 days",
    target=0.97,
    limit_s=600.0,
)
PARKING1_IMPROVED = Experiment(
    "parking1-improved",
    "Parking 1, improved",
    "parking1-improved",
    judged=(replace(NEW_SPOTS, episodes=4000), VALIDATION),
    document="not attempted",
    target=0.97,
)
PARKING2_IMPROVED = Experiment(
    "parking2-improved",
    "Parking 2, improved",
    "parking2-improved",
    judged=(replace(NEW_SPOTS, episodes=4000), VALIDATION),
    document="not attempted",
    target=0.98,
)

_HEADLINE_WORDS = """\
Our recipes (`policies/recipes/`), one core each. New spots lie in cells of 1 m that training never used; each of
these touches one that it did. What that hides stands [below](#like-for-like-few-goals-and-whole-quarters)."""

_HEADLINE_REMARKS = """\
"Parking 1, PPO + GAIL" owes the demonstrations next to nothing: they are paid with a strength of 0.002 beside 1 for the
task, and PPO alone parks as well. The document's own three goals, which its 92 % are of, are all found by four seeds of
five with 0.002, by five with 0.05, by four with 1, as much as the task pays, and by three with GAIL alone: it can teach
the task, and strong enough to matter it takes away where goals are new. The row to hold beside the document's is
"three goals, PPO + GAIL" [below](#like-for-like-few-goals-and-whole-quarters): 93 % on those goals, 99 % with drawn
actions, 74 % on new spots.

Of the seeds of each row the policy ships that did best where none was trained and none is tested: on validation spots,
targets in validation squares of the ground or, of RollerBall, other draws.

What ships for "Parking 1, improved" parks on 97.42 % (96.89 to 97.87 %) of 4,000 new spots. 97 % is wanted: that figure
meets it, where its interval begins does not, nor do the four seeds that do not ship (96.12 to 96.95 %). Tried for it
and given up: time that costs nearly twice as much (with less sharpening and 8 million steps, one seed): 94.6 % of 4,000
new spots; it hit walls and blocks in 2.6 %.

What ships for "Parking 2, improved" (seed 5) parks on 97.65 % (97.13 to 98.08 %) of 4,000 new spots. In 80 of the 94
others a moving obstacle hit it, in 13 it drove into a wall. 98 % is wanted (95 % until now) and not reached. It is no
better, as far as 4,000 episodes can tell, than the first of five seeds that shipped once (97.25 %), which had two
frames, rays of 20 m, no sharpening, its last policy, 48 million steps and 540 cells; the five came to 96.84 % (96.21
to 97.47 %) of 1,000 new spots each, and what the changes did was not told apart. Four frames and rays of 10 m without
sharpening were as good as before after 10 million steps, and so were spheres of 0.5 m for rays after 8 million.
Tried, one seed each: twice as many rays, without sharpening, 48 million steps: 96.58 % (95.97 to 97.10 %) of 4,000,
and 97.38 % (96.83 to 97.83 %) with drawn actions; going on from the policy before with -6 for every hit (it had -2
for obstacles, -1 for walls), stopped after 5.5 million steps at 96.8 % of 2,000 training spots; going on with -4,
faster obstacles in the first half, larger buffers and sharpening, 8 million steps: 97.30 % (96.75 to 97.76 %). From
nothing, -6 was stopped after 6 million steps at 90.6 % of the drawn episodes, as the five seeds had by then, and -4
with less entropy after 4 million at 84 %."""

_HEADLINE_FAILURES = """\
![Parking that failed, from above](images/failed-parking.png)

Failures of the improved policies that ship, the first of each kind and the next, of 500 episodes on new spots
(`python -m docs.generate.failed_parking`): car blue, spot red, portals green, and what moves with its last second."""

_LIKE_FOR_LIKE_WORDS = """\
The document trained on one goal (PPO) and on three (PPO + GAIL); the rows above on some 500 cells of 1 m all over the
arena, one of which every test cell touches. Here our recipe for 2 million steps on the document's own goals, judged
from its start between its blocks; and on goals anywhere but in one quarter of the arena, judged in that quarter. What
the car sees is relative to it in every row."""

_LIKE_FOR_LIKE_REMARKS = """\
On few goals the recipe learns few roads: nearly every failure on new spots is a block in the way. Only where starts
and blocks are others in each episode does it learn to drive around what it sees, and three goals are enough then for
what the document reports: its 92 % are within what five seeds come to. Sharpening made no difference that they could
show. Where the most probable actions turn to and fro for ever on one of three goals, they do so in each of its
episodes, since the start is the same. Of the quarters, the one that holds the start is bridged; in the others the car
hits blocks, or in one of them walls, on roads that it was never sent down. One of the two worst is nearly bridged,
too, once starts and blocks are others in each episode. Imitation of the planner (400 episodes on those goals) finds
the three goals, too, beside PPO (but for two seeds of fifteen, one goal each), by cloning alone, or, in three seeds
of five, by GAIL alone. It does not help on new spots: with GAIL as strong as the task four seeds of five park on
fewer than any by PPO alone (62.7 % in place of 73.0 %, of five), by cloning alone 56.1 %, with walls hit as well as
blocks, and GAIL alone is anything from 4 to 69 %. Mirroring every other episode in training does not help on new
spots: alone it parks on no more than without it, and where starts and blocks are anywhere it changes nothing that
five seeds could show."""

_DONE_RIGHT_REMARKS = """\
Where chance does not find the goal, novelty does: the top of Gymnasium's MountainCar, paid there alone, with settings
that are the same but for the signal. PPO alone found it in one seed of five, late; given 150,000 steps that seed came
to 97.7 %, and 100,000 were chosen after that. Where each step costs 1, as published, PPO needs no novelty to find it,
probably because what it has tried is worse than it expected. Strength is 1 here, 0.01 in the rows of Parking 1, whose
goal PPO finds by chance: novelty delays it there, and in one seed of five made it forget after two million steps, for
good with curiosity, for a while with RND.

Three stacked observations make no difference to Parking 2 that five seeds could show beside the row of the headline:
the same recipe, both ended by its success target. They are ours, with distances and
speed in them. The document's own, stacked likewise: three seeds of five park on 99 % of the spots of both storeys, two
never find the second storey in ten million steps.

On the tasks of the documents no gain was found. Two more were tried with RND, one seed each. A4 with 2 x 128 units, by
the seed that comes to 0.2 % with PPO alone, came to 0.5 % with a strength of 0.1. Parking 2's one published spot, paid
for parking there alone, came to 0 of 1,000 after 3 million steps, with a strength of 1 beside 2 of what the task
pays."""

SECTIONS: tuple[Section, ...] = (
    Section(
        "The headline",
        _HEADLINE_WORDS,
        (ROLLER_BALL, REACH, PARKING1, PARKING1_GAIL, PARKING2, PARKING1_IMPROVED, PARKING2_IMPROVED),
        (
            Image("parking1", "Parking 1: from nothing to parked", {"PPO": "parking1", "PPO + GAIL": "parking1-gail"}),
            Image("parking2", "Parking 2: two storeys, portals, moving obstacles", {"PPO": "parking2"}),
            Image(
                "improved",
                "Random starts, goals and obstacles; pose and speed count",
                {"Parking 1": "parking1-improved", "Parking 2": "parking2-improved"},
            ),
        ),
        _HEADLINE_REMARKS,
        _HEADLINE_FAILURES,
    ),
    Section(
        "Learning to Drive: five variants",
        "The document's settings, 2 million steps each: 16 areas, PPO in ML-Agents' form. A4 has the sparse reward.\n"
        "Rows of 3 x 512 units but A3 are of two seeds, where five are wanted: they say what can come of it,\n"
        "not how often. Their later seeds were trained on a machine of half the speed.",
        REACH_CURVES,
        (
            Image(
                "reach-target-512",
                "Reach target, the document's settings (3 x 512)",
                {variant: f"reach-{variant.lower()}-512" for variant in VARIANTS},
                value="reward",
                over="steps",
            ),
            Image(
                "reach-target-128",
                "Reach target, a smaller network (2 x 128), mean of five seeds",
                {variant: f"reach-{variant.lower()}-128" for variant in VARIANTS},
                value="reward",
                over="steps",
            ),
        ),
    ),
)

_LIKE_FOR_LIKE = Section(
    "Like for like: few goals, and whole quarters",
    _LIKE_FOR_LIKE_WORDS,
    (*FEW_GOALS, *QUARTERS, QUARTER_ANYWHERE),
    remarks=_LIKE_FOR_LIKE_REMARKS,
)

_DONE_RIGHT = Section(
    "What failed, or never really ran",
    "Curiosity, RND and SAC were tried and given up, no LSTM was ever built, the drone document's hyper-network was "
    "inert. Here each stands beside the same run without it, for as many steps.",
    (*SPARSE, *HILL, *MEMORY, *OTHERS),
    (
        Image(
            "sparse",
            "Parking 1 paid at the end only",
            {"PPO": "parking1-sparse"} | {n: f"parking1-sparse-{n.lower()}" for n in ("Curiosity", "RND", "GAIL")},
            over="steps",
        ),
        Image(
            "mountain-car-top",
            "MountainCar, paid at the top only",
            {"PPO": "mountain-car-top"} | {n: f"mountain-car-top-{n.lower()}" for n in ("Curiosity", "RND")},
            over="steps",
        ),
        Image(
            "memory",
            "Parking 1 seen as documented: without ranges and speed",
            {"feed-forward": "parking1-seen", "stack of 3": "parking1-seen-stack", "LSTM": "parking1-seen-lstm"},
            over="steps",
        ),
    ),
    _DONE_RIGHT_REMARKS,
)
SECTIONS = (*SECTIONS, _LIKE_FOR_LIKE, _DONE_RIGHT)
EXPERIMENTS = {experiment.name: experiment for section in SECTIONS for experiment in section.experiments}
