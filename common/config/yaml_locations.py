"""YAML files read with the line of every key, so that each error and warning can say where.

In: a file. Out: its mappings as `Located`, which are plain dicts that remember where their keys stand. A merge of two
of them keeps the location of each key, whichever file it came from.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from common.config.refusal import shown

MAX_NODES = 100_000  # aliases of aliases grow without bound


class ConfigError(ValueError):
    """A configuration that cannot be used; the message is one sentence for the user: `FILE:LINE: key: …`."""


@dataclass(frozen=True, slots=True)
class Location:
    """A line of a file; 0: the file as a whole."""

    file: str
    line: int = 0

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else self.file


class Located(dict[str, Any]):
    """A mapping of the file; `location` is where it begins, `locations` where its keys stand."""

    def __init__(self, location: Location) -> None:
        super().__init__()
        self.location = location
        self.locations: dict[str, Location] = {}

    def put(self, key: str, value: Any, location: Location | None = None) -> None:
        """Sets a key, and where it stands."""
        self[key] = value
        self.locations[key] = location or self.location

    def take(self, key: str, source: "Located", source_key: str | None = None) -> None:
        """Copies a key with its location from another mapping, which may call it otherwise."""
        name = source_key or key
        self.put(key, source[name], source.locations[name])

    def location_of(self, key: str) -> Location:
        """Where a key stands, or would stand."""
        return self.locations.get(key, self.location)

    def drop(self, key: str) -> None:
        """Takes a key away."""
        del self[key], self.locations[key]

    def copy(self) -> "Located":
        """The same keys and values in a mapping of its own."""
        return merged(Located(self.location), self)


def merged(base: Located, over: Located, *, is_deep: bool = False) -> Located:
    """`base` with the keys of `over` put over it; deep: mappings inside mappings are merged too."""
    result = Located(over.location)
    for source in (base, over):
        for key, value in source.items():
            is_both = is_deep and isinstance(result.get(key), Located) and isinstance(value, Located)
            result.put(key, merged(result[key], value, is_deep=True) if is_both else value, source.locations[key])
    return result


def mapping_at(parent: Located, key: str) -> Located:
    """The mapping of a key; an empty one where the key is missing or has no value.

    Raises:
        ConfigError: the value is something else.
    """
    value = parent.get(key)
    if value is None:
        return Located(parent.location_of(key))
    if not isinstance(value, Located):
        raise error_at(parent.location_of(key), key, f"must be a mapping of keys to values, not {shown(value)}")
    return value


def error_at(location: Location, key: str, sentence: str) -> ConfigError:
    """The error for the user."""
    return ConfigError(note_at(location, key, sentence))


def note_at(location: Location, key: str, sentence: str) -> str:
    """`FILE:LINE: key: sentence`."""
    return ": ".join(part for part in (str(location), key, sentence) if part)


def _loader(text: str) -> Any:
    """PyYAML's safe loader, which leaves dates as text: no key of ours is a date, but a run may be called by one."""
    loader = yaml.SafeLoader(text)
    loader.yaml_implicit_resolvers = {
        first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:timestamp"]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }
    return loader


def read_yaml(path: Path | str, notes: list[str]) -> Located:
    """The file's mapping.

    Args:
        path: the file.
        notes: warnings are appended.

    Raises:
        ConfigError: no such file, not YAML, or not a mapping.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise error_at(Location(str(path)), "", "is not UTF-8 text") from None
    except OSError as error:
        raise error_at(Location(str(path)), "", (error.strerror or "cannot be read").lower()) from None
    return parse_yaml(text, str(path), notes)


def parse_yaml(text: str, file: str, notes: list[str]) -> Located:
    """The text's mapping; `file` is what messages call it.

    Raises:
        ConfigError: not YAML, or not a mapping.
    """
    try:
        loader = _loader(text)
        node = loader.get_single_node()
        if not isinstance(node, yaml.MappingNode):
            what = "is empty" if node is None else "must be a mapping of keys to values"
            raise error_at(Location(file), "", what)
        return _Walk(loader, file, notes).mapping(node, "", ())
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        location = Location(file, mark.line + 1 if mark else 0)
        raise error_at(
            location, "", f"not YAML: {_one_line(error.problem or error.context or 'cannot be read')}"
        ) from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise error_at(Location(file, line), "", f"not YAML: character {error.character:#x} is not allowed") from None
    except RecursionError:
        raise error_at(Location(file), "", "not a configuration: nested too deeply") from None


def _one_line(text: str) -> str:
    return " ".join(text.split())


class _Walk:
    """Nodes of one file turned into plain values and `Located` mappings."""

    def __init__(self, loader: Any, file: str, notes: list[str]) -> None:
        self._loader = loader
        self._file = file
        self._notes = notes
        self._nodes_left = MAX_NODES
        self._merged_sizes: dict[int, int] = {}

    def mapping(self, node: yaml.MappingNode, path: str, above: tuple[int, ...]) -> Located:
        """One mapping; `above` are the nodes it lies in."""
        self._enter(node, path, above)
        self._note_duplicates(node, path)
        self._charge(node, path, self._merged_size(node, ()) - len(node.value))
        self._loader.flatten_mapping(node)  # the merge key <<
        result = Located(self._place(node))
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                raise error_at(self._place(key_node), path, "a key must be plain text")
            key = key_node.value
            below = f"{path}.{key}" if path else key
            result.put(key, self._value(value_node, below, (*above, id(node))), self._place(key_node))
        return result

    def _value(self, node: yaml.Node, path: str, above: tuple[int, ...]) -> Any:
        if isinstance(node, yaml.MappingNode):
            return self.mapping(node, path, above)
        if isinstance(node, yaml.SequenceNode):
            self._enter(node, path, above)
            return [self._value(item, f"{path}[{k}]", (*above, id(node))) for k, item in enumerate(node.value)]
        try:
            return self._loader.construct_object(node)
        except ValueError:  # what looks like a number and is none
            return node.value

    def _enter(self, node: yaml.Node, path: str, above: tuple[int, ...]) -> None:
        if id(node) in above:
            raise error_at(self._place(node), path, "contains itself")
        self._charge(node, path, len(node.value))

    def _charge(self, node: yaml.Node, path: str, count: int) -> None:
        self._nodes_left -= count
        if self._nodes_left < 0:
            raise error_at(self._place(node), path, f"more than {MAX_NODES} values, aliases written out")

    def _merged_size(self, node: yaml.Node, above: tuple[int, ...]) -> int:
        """How many keys a mapping has once its merge keys are written out, counted without writing them."""
        if not isinstance(node, yaml.MappingNode):
            return 0
        if id(node) in above:
            raise error_at(self._place(node), "", "contains itself")
        if id(node) not in self._merged_sizes:
            size = 0
            for key_node, value_node in node.value:
                is_merge = key_node.tag == "tag:yaml.org,2002:merge"
                many = isinstance(value_node, yaml.SequenceNode)
                merged = (value_node.value if many else [value_node]) if is_merge else []
                size += sum(self._merged_size(each, (*above, id(node))) for each in merged) if is_merge else 1
            self._merged_sizes[id(node)] = size
        return self._merged_sizes[id(node)]

    def _note_duplicates(self, node: yaml.MappingNode, path: str) -> None:
        seen: set[str] = set()
        for key_node, _ in node.value:
            if isinstance(key_node, yaml.ScalarNode) and key_node.value in seen and key_node.value != "<<":
                below = f"{path}.{key_node.value}" if path else key_node.value
                self._notes.append(note_at(self._place(key_node), below, "stands here twice; the last one counts"))
            seen.add(str(key_node.value))

    def _place(self, node: yaml.Node) -> Location:
        return Location(self._file, node.start_mark.line + 1)


def location_at(root: Located, loc: tuple[int | str, ...]) -> tuple[Location, str]:
    """Where the value of a path stands, as near as the file says, and the path as text."""
    location, text = root.location, ""
    value: Any = root
    for step in loc:
        if isinstance(step, int):
            text += f"[{step}]"
            value = value[step] if isinstance(value, list) and step < len(value) else None
            location = value.location if isinstance(value, Located) else location
        else:
            text = f"{text}.{step}" if text else step
            location = value.locations.get(step, location) if isinstance(value, Located) else location
            value = value.get(step) if isinstance(value, Located) else None
    return location, text
