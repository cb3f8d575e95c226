"""What the vehicle remembers over a restart: parameters that differ from their defaults, lists, a home it was given.

Each change is noted before it is acknowledged to the client, so it survives a killed process. Whole records, which
survive a loss of power too, are written at most once per second of simulated time, and at the end.
"""

from collections.abc import Callable, Collection, Mapping
from typing import Any

from autopilot.commander.home import Home
from autopilot.interface.item_lists import ItemLists, ListKind, MissionItem, item_name
from autopilot.interface.platform import Storage
from autopilot.interface.vehicle_state import Verdict
from common.geodesy import GeoPoint
from common.params import Parameter, ParameterError, ParameterTable

PARAMETERS = "parameters"
GIVEN_HOME = "given_home"  # by a client; where the vehicle boots is not the vehicle's affair
WRITE_PERIOD_US = 1_000_000

_HOME_FIELDS = ("lat_deg", "lon_deg", "alt_m")


class Persistence:
    """Restores one vehicle's records and keeps them.

    Args:
        storage: where they are.
        params: gets the stored values now; later changes are kept.
        chosen: parameters that this run was given: what is stored of them stays stored, and is not used.
        passing: parameters that are this run's alone: they are not kept.
    """

    def __init__(
        self,
        storage: Storage,
        params: ParameterTable,
        chosen: Collection[str] = (),
        passing: Collection[str] = (),
    ) -> None:
        self.problems: list[str] = []  # one sentence for each record of which something could not be used
        self.on_trouble: Callable[[str], None] = self.problems.append  # hears when something cannot be stored
        self._storage = storage
        self._params = params
        self._passing = passing
        self._lists: ItemLists | None = None
        self._home: dict[str, Any] = {}
        self._unwritten: set[str] = set()
        self._write_us = 0
        self._values: dict[str, Any] = storage.read(PARAMETERS)
        unusable = [name for name in self._values if name not in chosen and not self._restore(name)]
        if unusable:
            self.problems.append(f"stored parameters that do not fit, and are left alone: {', '.join(unusable)}")
        params.on_change(self._parameter_changed)

    def _restore(self, name: str) -> bool:
        try:
            self._params.set_exactly(name, self._values[name])
        except (ParameterError, TypeError, OverflowError):
            return False
        return True

    def keep_lists(self, lists: ItemLists) -> None:
        """Restores mission, fence and rally points; later changes are kept."""
        self._lists = lists
        for kind in ListKind:
            content = self._storage.read(_record(kind))
            if content:
                self._restore_list(lists, kind, content)
        lists.on_change(self._list_changed)

    def keep_home(self, home: Home) -> None:
        """Restores the home that a client gave; a later one is kept."""
        stored = self._storage.read(GIVEN_HOME)
        if stored:
            try:
                reply = home.set(*(float(stored[name]) for name in _HOME_FIELDS), has_position=False)
            except (KeyError, TypeError, ValueError, OverflowError):
                self.problems.append("the stored home is no place; it is left out")
            else:
                if reply.verdict is not Verdict.ACCEPTED:
                    self.problems.append(f"the stored home is left out: {reply.reason}")
        home.on_given = self._home_given

    def _home_given(self, home: GeoPoint) -> None:
        self._home = {name: getattr(home, name) for name in _HOME_FIELDS}
        self._note(GIVEN_HOME, self._home)

    def _restore_list(self, lists: ItemLists, kind: ListKind, content: Mapping[str, Any]) -> None:
        try:
            items = [_item(seq, each) for seq, each in enumerate(content["items"])]
        except (KeyError, TypeError, ValueError, OverflowError):
            self.problems.append(f"the stored {_record(kind)} is not a list of items; it is left out")
            return
        refusal = lists.load(kind, items)
        if refusal is not None:
            self.problems.append(f"the stored {_record(kind)} is left out: {item_name(refusal.seq)}: {refusal.reason}")

    def frame(self, time_us: int) -> None:
        """Writes what has changed, if it is time."""
        if self._unwritten and time_us >= self._write_us:
            self._write_us = time_us + WRITE_PERIOD_US
            self.write()

    def write(self) -> None:
        """Writes what has changed."""
        for record in sorted(self._unwritten):
            content = self._content_of(record)
            try:
                self._storage.write(record, content)
            except OSError as error:  # a full disk is no reason to fall from the sky
                self.on_trouble(f"{record.capitalize()} not stored: {error.strerror}")
            else:
                self._unwritten.discard(record)

    def _content_of(self, record: str) -> Mapping[str, Any]:
        if record == PARAMETERS:
            return self._values
        return self._home if record == GIVEN_HOME else self._list_content(ListKind[record.upper()])

    def _parameter_changed(self, declaration: Parameter) -> None:
        name = declaration.name
        if name in self._passing:
            return
        value = self._params[name]
        if value == declaration.default:
            self._values.pop(name, None)
        else:
            self._values[name] = value
        self._note(PARAMETERS, {name: self._values.get(name)})

    def _list_changed(self, kind: ListKind) -> None:
        self._note(_record(kind), self._list_content(kind))

    def _note(self, record: str, changes: Mapping[str, Any]) -> None:
        try:
            self._storage.note(record, changes)
        except OSError as error:
            self.on_trouble(f"{record.capitalize()} not stored: {error.strerror}")
        self._unwritten.add(record)

    def _list_content(self, kind: ListKind) -> dict[str, Any]:
        items = () if self._lists is None else self._lists.items(kind)
        return {"items": [_content(item) for item in items]}


def _record(kind: ListKind) -> str:
    return kind.name.lower()


def _content(item: MissionItem) -> dict[str, Any]:
    """An item as JSON; NaN is written as null."""
    return {
        "command": item.command,
        "frame": item.frame,
        "params": [None if value != value else value for value in item.params],
        "position": [None if value != value else value for value in (item.x, item.y, item.z)],
        "autocontinue": item.autocontinue,
    }


def _item(seq: int, content: Mapping[str, Any]) -> MissionItem:
    p1, p2, p3, p4 = (_number(value) for value in content["params"])
    x, y, z = (_number(value) for value in content["position"])
    is_autocontinue = bool(content["autocontinue"])
    return MissionItem(seq, int(content["frame"]), int(content["command"]), (p1, p2, p3, p4), x, y, z, is_autocontinue)


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)
