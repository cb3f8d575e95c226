"""Rows that are like for like: Parking 1 on the document's own few goals, and with whole quarters held out."""

from typing import Any

from bench.cars.experiment import Experiment, Judged

# The document's own goals, start and blocks, on which every row of these is judged.
_AS_PUBLISHED = {"starts": "published", "obstacles": "published", "mirrored": False}
_ANYWHERE = {"starts": "anywhere", "obstacles": "anywhere"}
_TWO_MILLION: dict[str, Any] = {
    "behavior.max_steps": 2_000_000,
    "behavior.success_target": None,
    "behavior.keep_best": False,
}
_FEW_GOALS = (
    Judged("the goals of training", _AS_PUBLISHED),
    Judged("new spots", _AS_PUBLISHED | {"split": "test", "goals": "anywhere"}),
)


# Nothing but cloning: what PPO learns beside it is made nothing, as its rewards are.
_CLONING: dict[str, Any] = {
    "behavior.reward_signals.extrinsic.strength": 0.0,
    "behavior.hyperparameters.learning_rate": 1e-9,
    "behavior.behavioral_cloning": {"demo_path": "recorded", "strength": 1e6, "samples_per_update": 32768},
}


def _few_goals(
    name: str,
    title: str,
    document: str,
    settings: dict[str, Any],
    changes: dict[str, Any] | None = None,
    recipe: str = "parking1",
) -> Experiment:
    """Parking 1 trained on the document's goals alone."""
    settings = {"goals": "published", **settings}
    return Experiment(
        name,
        title,
        recipe,
        settings=settings,
        changes=_TWO_MILLION | (changes or {}),
        judged=_FEW_GOALS,
        document=document,
    )


def _gail_goals(name: str, title: str, document: str, changes: dict[str, Any]) -> Experiment:
    """The same with GAIL, demonstrated on those goals."""
    return _few_goals(name, title, document, {}, changes, "parking1-gail")


FEW_GOALS = (
    _few_goals("parking1-goal", "one goal", "13 % (PPO)", {"goals": "one"}),
    _few_goals("parking1-goals", "three goals", "", {}),
    _gail_goals("parking1-goals-gail", "three goals, PPO + GAIL", "92 % (PPO + GAIL)", {}),
    _gail_goals(
        "parking1-goals-gail-strong",
        "the same, GAIL 25 times as strong",
        "",
        {"behavior.reward_signals.gail.strength": 0.05},
    ),
    _gail_goals(
        "parking1-goals-gail-even",
        "the same, GAIL as strong as the task",
        "",
        {"behavior.reward_signals.gail.strength": 1.0},
    ),
    _gail_goals(
        "parking1-goals-gail-alone",
        "three goals, GAIL alone",
        "",
        {"behavior.reward_signals.gail.strength": 1.0, "behavior.reward_signals.extrinsic.strength": 0.0},
    ),
    _few_goals("parking1-goals-cloning", "three goals, cloning alone", "", {}, _CLONING),
    _few_goals("parking1-goals-both", "three goals, starts and blocks anywhere", "", _ANYWHERE),
    _few_goals(
        "parking1-goals-sharp",
        "the same, choices sharpened",
        "",
        _ANYWHERE,
        {"behavior.hyperparameters.sharpening": 10},
    ),
    _few_goals("parking1-goals-mirrored", "three goals, every other episode mirrored", "", {"mirrored": True}),
    _few_goals(
        "parking1-goals-mirrored-both",
        "the same, starts and blocks anywhere",
        "",
        _ANYWHERE | {"mirrored": True},
    ),
)
QUARTERS = tuple(
    Experiment(
        f"parking1-quarter-{quarter}",
        f"goals anywhere but in the quarter of {where}",
        "parking1",
        settings={"quarter": quarter},
        changes=_TWO_MILLION,
        judged=(Judged("that quarter", {"split": "test"}),),
        document="",
    )
    for quarter, where in enumerate(("low x, low z", "high x, low z", "low x, high z", "high x, high z"), start=1)
)
QUARTER_ANYWHERE = Experiment(
    "parking1-quarter-2-anywhere",
    "high x, low z held out; starts and blocks anywhere",
    "parking1",
    settings=_ANYWHERE | {"quarter": 2},
    changes=_TWO_MILLION,
    judged=(Judged("that quarter, as published", _AS_PUBLISHED | {"split": "test"}),),
    document="",
)
