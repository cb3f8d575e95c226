"""A flight keeps what a dataset needs: each decision of its companion as a topic of its log, the images beside it."""

from pathlib import Path

from mission.dataset.companion_log import IMAGES_FILE, DecisionRecording, ImageFile
from mission.flight_base import FlightBase
from policies.companion.companion import Companion
from policies.companion.decision_log import TOPIC, topic_fields, topic_info


def record_flight(flight: FlightBase, companion: Companion, folder: Path, pilot: str) -> DecisionRecording:
    """Lets a flight that has not begun keep what a dataset needs.

    Args:
        flight: what is flown; it has a log.
        companion: on board of it.
        folder: of the run.
        pilot: who decides, for the log.
    """
    skill = companion.skill
    layout, image_layout = skill.record_layout, skill.image_layout
    about = topic_info(layout, pilot, skill.stances, image_layout)
    write = flight.recorder.keep_topic(TOPIC, topic_fields(layout, image_layout), about)
    images = ImageFile(folder / IMAGES_FILE, flight.troubles.note) if skill.camera is not None else None
    return DecisionRecording(companion, write, images)
