"""`--guard`, `--no-guard` and `--guard-setting NAME=VALUE` of the commands that fly a policy. Light to import."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from policies.companion.guard.settings import GuardSettings

FLAG = "--guard-setting"


def guard_of(has_guard: bool, given: Sequence[str]) -> "GuardSettings":
    """The guard that the options ask for.

    Args:
        has_guard: of `--guard`.
        given: of each `--guard-setting`.

    Raises:
        UserError: no such setting, or a value that it cannot have.
    """
    from mission.console.option_checks import UserError
    from policies.companion.guard.settings import GuardSettingError, GuardSettings, guard_settings

    if given and not has_guard:
        raise UserError(f"{FLAG} and --no-guard: choose one")
    if not has_guard:
        return GuardSettings(is_on=False)
    values: dict[str, float] = {}
    for text in given:
        name, _, value = text.partition("=")
        try:
            values[name] = float(value)
        except ValueError:
            raise UserError(f"{FLAG} {text}: must be NAME=NUMBER") from None
    try:
        return guard_settings(values)
    except GuardSettingError as error:
        raise UserError(f"{FLAG} {error}") from error
