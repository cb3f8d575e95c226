"""`honeyguide dataset show`: what a dataset comes to: tables, a picture of histograms, and a film of an episode."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from common.files import part_path
from mission.console.terminal import print_line
from policies.datasets.episodes import DatasetError
from policies.datasets.reader import DatasetReader
from policies.datasets.statistics import SPAN, DatasetStatistics, ElementStatistics, statistics_of

FILM_SIZE = 480  # [pixel]
_COLUMNS = 6  # of the picture of histograms


def show_dataset(folder: Path, console: Console, *, picture: Path | None, film: Path | None, episode: int) -> None:
    """Prints what it comes to, and writes what is asked for.

    Raises:
        DatasetError: it cannot be read, or a file not be written.
        VideoError: the film cannot be written.
    """
    with DatasetReader(folder) as reader:
        found = statistics_of(reader)
        _print(reader, found, console)
        if picture is not None:
            _draw(found, picture)
            print_line(console, f"histograms: {picture}")
        if film is not None:
            if not 0 <= episode < reader.count:
                raise DatasetError(f"--episode {episode}: {folder} has episodes 0 to {reader.count - 1}")
            _film(reader, episode, film)
            print_line(console, f"episode {episode}: {film}")


def _print(reader: DatasetReader, found: DatasetStatistics, console: Console) -> None:
    origin, layout = reader.origin, reader.layout
    outcomes = ", ".join(f"{count} {outcome}" for outcome, count in found.outcomes.most_common())
    print_line(console, f"{layout.task}, layout version {layout.version}, by {origin.pilot}")
    print_line(console, f"{found.episodes} episodes, {found.steps} decisions: {outcomes}")
    print_line(
        console,
        f"return {found.returns.mean():.2f} ± {found.returns.std():.2f}, {found.returns.min():.2f} to "
        f"{found.returns.max():.2f}; rewards by the {origin.rewards_by}",
    )
    for name, text in origin.notes.items():
        print_line(console, f"{name}: {text}")
    for title, elements in (("observations", found.observations), ("actions", found.actions)):
        console.print(_table(title, elements))


def _table(title: str, elements: ElementStatistics) -> Table:
    table = Table("element", "mean", "std", "least", "most", title=title, title_justify="left")
    for row in zip(elements.names, elements.mean, elements.std, elements.least, elements.most, strict=True):
        table.add_row(row[0], *(f"{value:.3f}" for value in row[1:]))
    return table


def _draw(found: DatasetStatistics, target: Path) -> None:
    """Histograms of returns, lengths, and of each element."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    names = (*found.actions.names, *found.observations.names)
    counts = np.concatenate([found.actions.histogram, found.observations.histogram])
    rows = -(-(len(names) + 2) // _COLUMNS)
    figure, axes = plt.subplots(rows, _COLUMNS, figsize=(3.0 * _COLUMNS, 1.6 * rows), squeeze=False)
    places = list(axes.ravel())
    places[0].hist(found.returns, bins=30)
    places[0].set_title("return", fontsize=7)
    places[1].hist(found.lengths, bins=30)
    places[1].set_title("decisions of an episode", fontsize=7)
    middles = np.linspace(-SPAN, SPAN, counts.shape[1], endpoint=False) + SPAN / counts.shape[1]
    for place, name, row in zip(places[2:], names, counts, strict=False):
        place.bar(middles, row, width=2.0 * SPAN / counts.shape[1])
        place.set_title(name, fontsize=7)
    for place in places:
        place.tick_params(labelsize=5)
        place.set_yticks([])
    for place in places[len(names) + 2 :]:
        place.axis("off")
    figure.tight_layout()
    write_figure(figure, target, 80)


def write_figure(figure: Any, target: Path, dpi: int) -> None:
    """Writes a figure of matplotlib, and closes it.

    Raises:
        DatasetError: it cannot be written.
    """
    import matplotlib.pyplot as plt

    part = part_path(target)
    try:
        figure.savefig(part, dpi=dpi, format="png")
        part.replace(target)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise DatasetError(f"{target}: cannot be written: {error.strerror or error}") from error
    finally:
        plt.close(figure)


def _film(reader: DatasetReader, k: int, target: Path) -> None:
    """An episode as it was seen: its images if it has them, else curves of its actions, reward and observation."""
    from mission.video.video_file import Mp4

    episode = reader.episode(k)
    with Mp4(target, 0.1) as film:
        for i in range(len(episode)):
            image = None if episode.images is None else episode.images[i, ..., :3]
            film.show(_film_image(episode.observations[i], episode.actions[i], episode.rewards[: i + 1], image))


def _film_image(
    seen: NDArray[Any], action: NDArray[Any], rewards: NDArray[Any], image: NDArray[np.uint8] | None
) -> NDArray[np.uint8]:
    """One image: what was seen beside bars of the observation and the action, and the rewards so far below."""
    half = FILM_SIZE // 2
    out = np.full((FILM_SIZE, 2 * FILM_SIZE, 3), 24, np.uint8)
    if image is not None:
        times = max(FILM_SIZE // image.shape[0], 1)
        large = image.repeat(times, axis=0).repeat(times, axis=1)[:FILM_SIZE, :FILM_SIZE]
        out[: large.shape[0], : large.shape[1]] = large
    _bars(out[:half, FILM_SIZE:], seen, (90, 170, 250))
    _bars(out[half : half + half // 2, FILM_SIZE:], np.atleast_1d(action), (250, 170, 90))
    _bars(out[half + half // 2 :, FILM_SIZE:], rewards[-64:], (120, 220, 120))
    return out


def _bars(area: NDArray[np.uint8], values: Sequence[float] | NDArray[Any], colour: tuple[int, int, int]) -> None:
    """Bars from the middle of an area up and down; 1 is half of it."""
    height, width = area.shape[:2]
    middle, step = height // 2, max(width // max(len(values), 1), 1)
    area[middle] = 90
    for k, value in enumerate(values):
        size = int(np.clip(value, -1.0, 1.0) * (middle - 2))
        top, bottom = sorted((middle, middle - size))
        area[top : bottom + 1, k * step : k * step + max(step - 1, 1)] = colour
