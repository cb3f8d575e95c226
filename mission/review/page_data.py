"""What the page is given: the border to its JavaScript, hence dicts. Arrays travel once, as base64 float32."""

from base64 import b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np

from common.airframe import load_airframe
from mission.review.curves import ArrayPool, Curve, Panel, Rows
from mission.review.flight_review import FlightReview
from mission.review.panels.motion import TRUE
from mission.review.timeline import Span
from mission.review.vibration import Spectrum
from mission.view import shapes
from mission.view.web.page_arrays import Json, mesh_data

PLAIN_AIRFRAME = "x500"  # drawn for vehicles of others
DB_RANGE = (2.0, 99.8)  # percentiles of a waterfall between which its colours lie
TEXTS_MAX, PARAMETERS_MAX = 500, 2000


def page_data(reviews: Sequence[FlightReview], title: str) -> Json:
    """All that the page shows, of one flight or of several on one axis of time.

    Several flights are laid over each other where they took off.
    """
    pool = ArrayPool()
    shifts = [each.timeline.takeoff_s if len(reviews) > 1 else 0.0 for each in reviews]
    pairs = list(zip(reviews, shifts, strict=True))
    data: Json = {
        "title": title,
        "flights": [_flight(review, shift) for review, shift in pairs],
        "span": [
            min(-shift for shift in shifts),
            max(each.flight.duration_s - shift for each, shift in pairs),
        ],
        "sections": _sections(pairs, pool),
        "tracks": [_track(review, shift, pool) for review, shift in pairs],
        "spectra": [_spectrum(each, k, pool) for k, (review, _) in enumerate(pairs) for each in review.spectra],
        "waterfalls": [
            _waterfall(each, k, shift) for k, (review, shift) in enumerate(pairs) for each in review.spectra
        ],
        "spectra_missing": _together([review.spectra_missing for review in reviews], reviews),
        "vehicles": [_vehicle(review) for review in reviews],
        "sun_ned": shapes.SUN_NED.tolist(),
    }
    data["arrays"] = pool.texts()
    return data


def _flight(review: FlightReview, shift_s: float) -> Json:
    flight, when = review.flight, review.timeline
    return {
        "name": flight.name,
        "result": review.result,
        "summary": review.summary,
        "verdicts": [
            {"title": each.title, "level": each.level.name.lower(), "text": each.text} for each in review.verdicts
        ],
        "notes": flight.notes,
        "missing": when.missing,
        "checks": [
            {
                "name": check.name,
                "passed": check.is_passed,
                "margin": check.margin,
                "unit": check.unit,
                "worst": None if check.worst_s is None else check.worst_s - flight.start_s - shift_s,
                "asked": check.asked,
                "happened": check.happened,
            }
            for check in review.checks
        ],
        "has_defaults": flight.has_defaults or flight.is_own,
        "parameters": review.changed_parameters[:PARAMETERS_MAX],
        "texts": [[round(each.time_s - shift_s, 2), each.level, each.text] for each in when.texts[:TEXTS_MAX]],
        "modes": _spans(when.modes, shift_s),
        "armed": _spans(when.armed, shift_s),
        "airborne": _spans(when.airborne, shift_s),
        "failsafe": _spans(when.failsafe, shift_s),
    }


def _spans(spans: Sequence[Span], shift_s: float) -> list[list[Any]]:
    return [[span.name, round(span.start_s - shift_s, 3), round(span.end_s - shift_s, 3)] for span in spans]


def _sections(pairs: Sequence[tuple[FlightReview, float]], pool: ArrayPool) -> list[Json]:
    """The sections of all flights, panel by panel: the same panel of two flights is one."""
    reviews = [review for review, _ in pairs]
    found = []
    for k, section in enumerate(reviews[0].sections):
        same = [review.sections[k] for review in reviews]
        panels: dict[str, Json] = {}
        for number, (each, (_, shift)) in enumerate(zip(same, pairs, strict=True)):
            for panel in each.panels:
                shown = panels.setdefault(panel.key, _panel(panel))
                compared = [curve for curve in panel.curves if len(pairs) == 1 or curve.name != TRUE]
                shown["curves"] += [_curve(curve, number, shift, pool) for curve in compared]
        found.append(
            {
                "key": section.key,
                "title": section.title,
                "remark": next((each.remark for each in same if each.remark), ""),
                "missing": _together([each.missing for each in same], reviews),
                "panels": list(panels.values()),
            }
        )
    return found


def _together(missing: Sequence[Sequence[str]], reviews: Sequence[FlightReview]) -> list[str]:
    """What flights lack, each told of which flight it is where there are several."""
    if len(reviews) == 1:
        return list(missing[0])
    named = zip(reviews, missing, strict=True)
    return [f"{review.flight.name}: {', '.join(lacks)}" for review, lacks in named if lacks]


def _panel(panel: Panel) -> Json:
    return {
        "key": panel.key,
        "title": panel.title,
        "unit": panel.unit,
        "bounds": panel.bounds,
        "least_span": panel.least_span,
        "zero": panel.starts_at_zero,
        "ceiling": panel.ceiling,
        "wraps": panel.wraps,
        "of_flight": panel.is_of_flight,
        "curves": [],
    }


def _curve(curve: Curve, number: int, shift_s: float, pool: ArrayPool) -> Json:
    return {
        "name": curve.name,
        "t": pool.add(curve.time_s - shift_s),
        "v": pool.add(curve.values),
        "setpoint": curve.is_setpoint,
        "step": curve.is_step,
        "flight": number,
    }


def _track(review: FlightReview, shift_s: float, pool: ArrayPool) -> Json | None:
    track = review.track
    if track is None:
        return None
    return {
        "t": pool.add(track.time_s - shift_s),
        "pos": pool.add(track.pos_ned.ravel()),
        "q": pool.add(track.q_ned_from_frd.ravel()),
        "setpoint": pool.add(track.setpoint_ned.ravel()),
        "home": None if track.home_ned is None else track.home_ned.tolist(),
        "waypoints": np.round(track.waypoints_ned, 2).tolist(),
        "source": track.source,
        "origin": None if track.origin is None else [track.origin.lat_deg, track.origin.lon_deg, track.origin.alt_m],
    }


def _spectrum(spectrum: Spectrum, number: int, pool: ArrayPool) -> Json:
    return {
        "key": spectrum.key,
        "title": spectrum.title,
        "unit": spectrum.unit,
        "flight": number,
        "freq": pool.add(spectrum.freq_hz),
        "axes": [pool.add(axis) for axis in spectrum.amplitude.T],
        "rate": round(spectrum.rate_hz, 1),
        "source": spectrum.source,
    }


def _waterfall(spectrum: Spectrum, number: int, shift_s: float) -> Json:
    low, high = np.percentile(spectrum.waterfall_db, DB_RANGE)
    levels = np.clip((spectrum.waterfall_db - low) / max(high - low, 1e-6), 0.0, 1.0)
    half_s = 0.5 * _step(spectrum.times_s)
    return {
        "key": spectrum.key,
        "title": spectrum.title,
        "unit": spectrum.unit,
        "flight": number,
        "span": [float(spectrum.times_s[0]) - half_s - shift_s, float(spectrum.times_s[-1]) + half_s - shift_s],
        "freq": [float(spectrum.freq_hz[0]), float(spectrum.freq_hz[-1])],
        "columns": levels.shape[0],
        "rows": levels.shape[1],
        "db": [round(float(low), 1), round(float(high), 1)],
        "levels": b64encode(np.round(255.0 * levels).astype(np.uint8).tobytes()).decode(),
    }


def _step(times_s: Rows) -> float:
    return float(np.median(np.diff(times_s))) if len(times_s) > 1 else 1.0


def _vehicle(review: FlightReview) -> Json:
    """What the vehicle looks like: ours by its airframe, others as the plain one."""
    try:
        airframe = load_airframe(str(review.flight.info.get("airframe", PLAIN_AIRFRAME)))
    except (OSError, ValueError):
        airframe = load_airframe(PLAIN_AIRFRAME)
    shape = shapes.vehicle(airframe)
    turning = [(shape.blade, hub - (0.0, 0.0, 0.03)) for hub in shape.hubs]
    turning += zip(shape.wheels, shape.wheel_hubs, strict=True)
    parts = [shapes.Mesh((mesh.vertices + hub).astype(np.float32), mesh.faces, mesh.colours) for mesh, hub in turning]
    return mesh_data(shapes.joined([shape.body, *parts]))
