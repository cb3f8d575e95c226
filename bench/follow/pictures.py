"""Shares by tree density and owner speed, as PNG."""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt

from bench.cars.curves import COLOURS
from bench.follow.result import Result
from bench.follow.stages import OWNER_SPEEDS, TREES_PER_HA

_SHOWN = {"in_band": "in the band", "success": "success", "tracking": "tracking", "collision": "collision"}


def draw(path: Path, title: str, result: Result) -> bool:
    """Writes one figure, batch as lines and flights as rings; false if there is nothing to draw."""
    cards = {is_flown: result.cards(is_flown=is_flown) for is_flown in (False, True)}
    if not any(trees is not None for kind in cards.values() for trees, _ in kind):
        return False
    figure, axes = plt.subplots(1, len(_SHOWN), figsize=(9.6, 2.9), dpi=100, sharey=True)
    for panel, (name, label) in zip(axes, _SHOWN.items(), strict=True):
        for colour, speed in zip(COLOURS, OWNER_SPEEDS, strict=False):
            for is_flown, kind in cards.items():
                shown = [
                    (trees, getattr(kind[trees, speed].card, name)) for trees in TREES_PER_HA if (trees, speed) in kind
                ]
                if not shown:
                    continue
                x = [trees * (1.04 if is_flown else 1.0) for trees, _ in shown]
                y = [item.value for _, item in shown]
                off = [[item.value - item.low for _, item in shown], [item.high - item.value for _, item in shown]]
                style = {"linestyle": "none", "marker": "o", "markerfacecolor": "none"} if is_flown else {"marker": "."}
                words = f"{speed:g} m/s{', flown' if is_flown else ''}"
                panel.errorbar(x, y, yerr=off, color=colour, linewidth=1.4, capsize=2, label=words, **style)
        panel.set_title(label, fontsize=9, loc="left")
        panel.set_xlabel("trees per hectare", fontsize=8)
        panel.set_ylim(-0.03, 1.03)
        panel.grid(alpha=0.25)
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(labelsize=8)
    axes[0].legend(frameon=False, fontsize=7, loc="lower left")
    figure.suptitle(title, fontsize=10, x=0.01, ha="left")
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    plt.close(figure)
    return True
