"""The picture of what a network tells of depth from colours, beside the truth.

`python -m docs.generate.mono_depth_picture`. Writes docs/images/mono-depth.png: scenes of worlds that it has not seen.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import torch

from policies.mono_depth.network import BINS, flat_ground, quantile_byte, shipped
from policies.mono_depth.views import views
from policies.person_detector.scenes import Stage
from policies.tasks.follow_me.observe import depth_of

PICTURE = Path(__file__).parents[1] / "images" / "mono-depth.png"
SEED, SHOWN, NEAR_M, FAR_M = 21, 5, 0.5, 12.0


def main() -> None:
    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415  after the choice of the backend

    there = views(Stage(SEED, is_test=True), 64)
    with torch.inference_mode():
        ground = flat_ground(torch.from_numpy(there.down_rdf), torch.from_numpy(there.height_m))
        logits = shipped().eval()(torch.from_numpy(there.colours), ground).numpy()
    told = quantile_byte(logits[:, :BINS].swapaxes(0, 1))
    shown = np.argsort(-(there.is_trunk & (there.byte < 160)).sum(axis=(1, 2)))[:SHOWN]  # the most of near trunks
    figure, axes = plt.subplots(3, SHOWN, figsize=(8, 5.2), layout="constrained")
    colours = {"vmin": np.log(NEAR_M), "vmax": np.log(FAR_M), "cmap": "viridis_r"}
    for column, k in enumerate(shown):
        axes[0, column].imshow(there.colours[k])
        for row, byte in ((1, there.byte[k]), (2, told[k])):
            metres = np.where(byte < 255, depth_of(np.minimum(byte, 254).astype(np.float64)), FAR_M)
            mapped = axes[row, column].imshow(np.log(np.clip(metres, NEAR_M, FAR_M)), **colours)
    for ax in axes.flat:
        ax.set_xticks([])
        ax.set_yticks([])
    for row, title in enumerate(("image", "true depth", "told from colours")):
        axes[row, 0].set_ylabel(title)
    ticks = (0.5, 1.0, 2.0, 4.0, 8.0, 12.0)
    bar = figure.colorbar(mapped, ax=axes[1:], ticks=np.log(ticks), shrink=0.8)
    bar.ax.set_yticklabels([f"{tick:g} m" for tick in ticks])
    figure.savefig(PICTURE, dpi=100)
    print(f"{PICTURE.name}: {PICTURE.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
