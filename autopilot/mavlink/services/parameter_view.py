"""The vehicle's parameters as the clients of a dialect see them: names, MAVLink types, values, one dense list.

In: the parameter table, the dialect's aliases and constants. Out: what the parameter protocol and the parameter file
say. Values are the clients' own: in their unit, under their name. Our own names are in the list too.
"""

from collections.abc import Callable

from autopilot.interface.ardupilot_vehicle import Alias, Constant
from autopilot.mavlink.dialects import Dialect
from common.params import Parameter, ParameterTable

_INTEGER_BOUNDS = {2: 127, 4: 32_767, 6: 2_147_483_647}  # by MAV_PARAM_TYPE


class ParameterView:
    """One vehicle's parameters under a dialect's names.

    Args:
        table: the parameters.
        dialect: whose names and encoding clients expect.
    """

    def __init__(self, table: ParameterTable, dialect: Dialect) -> None:
        self._table = table
        self._dialect = dialect
        self._aliases: dict[str, Alias] = {
            alias.name: alias for alias in dialect.aliases if alias.of in table and alias.name not in table
        }
        self._constants: dict[str, Constant] = {
            constant.name: constant
            for constant in dialect.constants
            if constant.name not in table and constant.name not in self._aliases
        }
        self.names = sorted([*table, *self._aliases, *self._constants])
        self.indices = {name: i for i, name in enumerate(self.names)}
        self._shown_as: dict[str, list[str]] = {name: [name] for name in table}
        for alias in self._aliases.values():
            self._shown_as[alias.of].append(alias.name)

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self.indices

    def param_type(self, name: str) -> int:
        """MAV_PARAM_TYPE."""
        if name in self._aliases:
            return self._aliases[name].param_type
        if name in self._constants:
            return self._constants[name].param_type
        return self._dialect.parameter_type(self._table.declarations[name])

    def is_integer(self, name: str) -> bool:
        return self.param_type(name) in _INTEGER_BOUNDS

    def value(self, name: str) -> int | float:
        """The value under this name."""
        if name in self._constants:
            return self._constants[name].value
        return self._shown(name, self._table[self._ours(name)])

    def default(self, name: str) -> int | float:
        """The default under this name."""
        if name in self._constants:
            return self._constants[name].value
        return self._shown(name, self._table.declarations[self._ours(name)].default)

    def bounds(self, name: str) -> tuple[float, float]:
        """Least and greatest value under this name."""
        if name in self._constants:
            return self._constants[name].value, self._constants[name].value
        declaration = self._table.declarations[self._ours(name)]
        alias = self._aliases.get(name)
        if alias is not None and alias.numbers is not None:
            return min(alias.numbers.values()), max(alias.numbers.values())
        return self._shown(name, declaration.minimum), self._shown(name, declaration.maximum)

    def meaning(self, name: str) -> str:
        """What it is for, in words."""
        if name in self._constants:
            return self._constants[name].meaning
        return self._table.declarations[self._ours(name)].meaning

    def unit(self, name: str) -> str:
        """The unit of a name of our own; of another one none: its scale may differ."""
        return self._table.declarations[name].unit if name in self._table else ""

    def set(self, name: str, asked: float) -> int | float:
        """Sets our parameter behind a name and returns the value that is now under it."""
        if name in self._constants:
            return self._constants[name].value
        alias = self._aliases.get(name)
        ours = asked if alias is None else alias.ours(asked)
        if ours is not None and asked != self.value(name):  # what is shown may be rounded: no change, no rounding
            self._table.set(self._ours(name), ours)
        return self.value(name)

    def bits(self, name: str) -> int:
        """The value field of PARAM_VALUE, as its 32 bits."""
        return self._dialect.parameter_bits(self.param_type(name), self.value(name))

    def value_in(self, name: str, bits: int, asked_type: int) -> float | None:
        """The value a PARAM_SET carries in its 32 bits; None if it is of the wrong type."""
        return self._dialect.parameter_value(self.param_type(name), bits, asked_type)

    def on_change(self, listener: Callable[[str], None]) -> None:
        """Calls `listener(name)` after each change, for every name under which it is seen."""

        def changed(declaration: Parameter) -> None:
            for name in self._shown_as[declaration.name]:
                listener(name)

        self._table.on_change(changed)

    def _ours(self, name: str) -> str:
        alias = self._aliases.get(name)
        return name if alias is None else alias.of

    def _shown(self, name: str, value: float) -> int | float:
        alias = self._aliases.get(name)
        if alias is None:
            return value
        shown = alias.shown(value)
        most = _INTEGER_BOUNDS.get(alias.param_type)
        return shown if most is None else max(-most - 1, min(most, round(shown)))
