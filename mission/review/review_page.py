"""The page of a review: one HTML file that needs nothing else, from the parts in `page/` and the data."""

import json
from collections.abc import Sequence
from html import escape
from importlib.resources import files

from mission.review.flight_review import FlightReview
from mission.review.page_data import page_data

SCRIPTS = ("core.js", "time_plot.js", "track_map.js", "scene.js", "spectrum.js", "review.js")


def review_page(reviews: Sequence[FlightReview], title: str) -> bytes:
    """The file of one flight, or of several laid over each other."""
    data = json.dumps(page_data(reviews, title), separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
    scripts = [files("mission.view.web").joinpath("webgl.js").read_text(encoding="utf-8")]
    scripts += [page_part(name) for name in SCRIPTS]
    page = page_part("review.html")
    for mark, text in (
        ("/*STYLE*/", page_part("review.css")),
        ("<!--TITLE-->", escape(title)),
        ("/*SCRIPTS*/", "\n".join(scripts)),
        ("/*DATA*/", data),
    ):
        page = page.replace(mark, text)
    return page.encode()


def page_part(name: str) -> str:
    """A file of the page, as text."""
    return files("mission.review.page").joinpath(name).read_text(encoding="utf-8")
