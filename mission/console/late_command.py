"""A command whose options are made when they are asked for, so that no other command waits for their model."""

from functools import cached_property
from typing import Any

import typer
from typer.core import TyperCommand


class LateCommand(TyperCommand):
    """Registered with a function that returns the command's own, whose arguments are the options."""

    @cached_property
    def _made(self) -> Any:
        made_by: Any = self.callback
        one = typer.Typer(add_completion=False, rich_markup_mode=None)
        one.command(name=self.name)(made_by())
        return typer.main.get_command(one)

    def get_params(self, ctx: Any) -> list[Any]:
        """What the command line, its help and the completion of a shell read."""
        return list(self._made.get_params(ctx))

    def invoke(self, ctx: Any) -> Any:
        return self._made.invoke(ctx)
