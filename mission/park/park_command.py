"""The command that parks: `honeyguide park`."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from rich.console import Console

from mission.console.command_refusal import learn_extra, refuse
from mission.console.name_checks import check_policy
from mission.console.terminal import loading

if TYPE_CHECKING:
    from mission.flight_settings import ParkOptions


def park() -> Callable[..., None]:
    """Let a rover park in a free spot of a car park, by a learned policy."""
    from mission.console.model_command import model_command
    from mission.flight_settings import PARKED_WITH, ParkOptions

    return model_command(ParkOptions, _park, names=PARKED_WITH)


def _park(options: "ParkOptions") -> int:
    with learn_extra():
        from mission.console.option_checks import UserError, check_end, check_vehicle, speed_of

        try:
            check_end(options, speed_of(options.speed))
            check_vehicle(options)
            check_policy(options.policy)
            from mission.flight_options import check_parameters

            check_parameters(options)
            with loading(Console()):
                from mission.park.park_session import park_session
            return park_session(options)
        except UserError as error:
            refuse(str(error))
