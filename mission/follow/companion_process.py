"""`honeyguide companion`: a policy as a process of its own, between the vehicle's MAVLink port and its camera.

In: addresses and a policy. Out: setpoints, and a line of figures. The wall clock is the companion's own; the vehicle's
clock comes with its telemetry.
"""

import gc
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.live import Live

from autopilot.mavlink.transport.client_links import open_client_link
from autopilot.mavlink.transport.links import LinkError
from common.clock import Pacer, wall_time_s
from mission.console.terminal import print_line
from mission.dataset.companion_log import COMPANION_LOG, CompanionLog
from mission.follow.guard_report import guard_text
from policies.companion.companion import MISFIT, Companion
from policies.companion.guard.settings import GuardSettings
from policies.companion.image_client import CameraUrlError
from policies.companion.pilot import PilotError
from policies.companion.skills.load_skill import load_skill

POLL_US = 2_000
PROGRESS_US = 500_000


class CompanionError(ValueError):
    """Something the user gave is wrong; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class CompanionOptions:
    """The options of `honeyguide companion`, as given."""

    policy: str
    link: str
    camera: str
    is_reported: bool
    seconds: float | None
    guard: GuardSettings
    is_by_sticks: bool = False
    follows: bool = False
    record: Path | None = None


def run_companion(options: CompanionOptions, console: Console) -> str:
    """Runs until it is stopped; returns what it did, in one sentence.

    Raises:
        CompanionError: the policy, or an address, cannot be used, and nothing has been sent; or the policy is not for
            the vehicle that was found, and no setpoint has been.
    """
    try:
        skill = load_skill(
            options.policy,
            options.camera,
            is_ordered_by_goto=options.is_reported,
            follows=options.follows,
            guard=options.guard,
        )
        if options.is_by_sticks and not skill.drives:
            raise CompanionError(f"--by-sticks: {options.policy} flies, and only what drives is driven by sticks")
        if options.is_by_sticks and not skill.is_along_nose:
            raise CompanionError(f"--by-sticks: {options.policy} asks for courses, and sticks for turns")
        link = open_client_link(options.link)
    except (PilotError, CameraUrlError, LinkError) as error:
        raise CompanionError(str(error)) from error
    by_sticks = options.is_by_sticks
    companion = Companion(link, skill, is_reported=options.is_reported, is_by_sticks=by_sticks, wall_s=wall_time_s)
    recording = _recording(companion, options, console)
    does = "drives" if skill.drives else "flies"
    images = f", pictures: {options.camera}" if skill.camera is not None else ""
    _shower(console)(f"{options.policy} {does}; vehicle: {options.link}{images}; Ctrl-C ends it")
    try:
        _loop(companion, options, console)
    except KeyboardInterrupt:
        pass
    finally:
        companion.close()
        if recording is not None:
            recording.close()
    return f"{guard_text(companion)}; {latency_text(companion)}"


def _recording(companion: Companion, options: CompanionOptions, console: Console) -> CompanionLog | None:
    """The log of its decisions, if one is wanted.

    Raises:
        CompanionError: it cannot be written, or there is one already; nothing has been sent.
    """
    folder = options.record
    if folder is None:
        return None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if (folder / COMPANION_LOG).exists():
            companion.close()
            raise CompanionError(f"--record {folder}: holds {COMPANION_LOG} already")
        return CompanionLog(companion, folder, options.policy, _shower(console))
    except OSError as error:
        companion.close()
        raise CompanionError(f"--record {folder}: cannot write there: {error.strerror or error}") from error


def _loop(companion: Companion, options: CompanionOptions, console: Console) -> None:
    seconds = options.seconds
    pacer = Pacer(1.0)
    start_s, shown_us = wall_time_s(), 0
    polled_us = 0
    show = _shower(console)
    gc.freeze()  # what is loaded by now stays: to look through it for garbage takes 0.2 s, in the middle of a flight
    with Live(console=console, transient=True, auto_refresh=False) as live:
        while seconds is None or wall_time_s() - start_s < seconds:
            time_us = int((wall_time_s() - start_s) * 1e6)
            before = companion.phase
            companion.frame(time_us)
            if companion.trouble == MISFIT:
                raise CompanionError(f"{options.policy}: {MISFIT} than the one at {options.link}")
            if companion.phase is not before:
                why = f": {trouble_text(companion)}" if companion.trouble else ""
                show(f"{time_us * 1e-6:7.1f} s  {companion.phase.value}{why}")
            if console.is_terminal and time_us - shown_us >= PROGRESS_US:
                shown_us = time_us
                live.update(progress_line(companion, time_us), refresh=True)
            polled_us = max(polled_us + POLL_US, time_us)
            pacer.wait_until(polled_us)


def _shower(console: Console) -> Callable[[str], None]:
    def show(text: str) -> None:
        print_line(console, text)

    return show


def trouble_text(companion: Companion) -> str:
    """Why the companion does not fly, with what is wrong with the camera if it is that."""
    hint = companion.skill.hint(companion.trouble)
    return f"{companion.trouble}: {hint}" if hint else companion.trouble


def progress_line(companion: Companion, time_us: int) -> str:
    """State, how far the owner or the goal is, how old the picture or the scan is, and how long a decision takes."""
    state = companion.phase.value + (f" ({trouble_text(companion)})" if companion.trouble else "")
    figures = companion.skill.figures(companion.vehicle.own, time_us)
    return f"{state} | {figures} | {latency_text(companion)}"


def latency_text(companion: Companion) -> str:
    """Median and 99th percentile of the time from a picture to its setpoint."""
    if not companion.latencies_s:
        return "no decision timed"
    median, late = np.percentile(np.array(companion.latencies_s) * 1e3, (50, 99))
    return f"picture to setpoint {median:.1f} ms, 99 % within {late:.1f} ms"
