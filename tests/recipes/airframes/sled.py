"""The section of a sled's airframe file, as `common/airframes/` would have it."""

from common.airframe import Airframe, Positive, Section


class Runners(Section):
    speed_m_s: Positive
    """On level snow."""


class SledAirframe(Airframe):
    runners: Runners


AIRFRAME = SledAirframe
