"""Rates of groups of messages as parameters (ArduPilot's SR0_*): on every link, those that come later too."""

from autopilot.ardupilot_only_params import STREAM_GROUPS
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Service
from common.params import Parameter


class StreamRateService(Service):
    """Follows the parameters, in ArduPilot's dialect."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        if endpoint.dialect.name != "ardupilot":
            return
        params = endpoint.vehicle.params
        for name in STREAM_GROUPS:
            if name in params and params[name] >= 0:
                self._apply(name)
        params.on_change(self._changed)

    def _changed(self, declaration: Parameter) -> None:
        if declaration.name in STREAM_GROUPS:
            self._apply(declaration.name)

    def _apply(self, name: str) -> None:
        endpoint, group = self._endpoint, STREAM_GROUPS[name]
        rate_hz = float(endpoint.vehicle.params[name])
        endpoint.telemetry.set_group_default(group, rate_hz)
        for channel in endpoint.channels:
            channel.schedule.reset_group(group)
