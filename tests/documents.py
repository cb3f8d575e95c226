"""The documentation as its tests see it: pages, links, commands and examples."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("common", "autopilot", "sim", "policies", "mission", "bench")

# <!-- vehicle --> is in front of an example that talks to a vehicle in another process
_FENCE = re.compile(r"^( *)(<!-- vehicle -->\n *)?```(\w*)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_REFERENCE = re.compile(r"^\[([^\]]+)\]: (\S+)$", re.MULTILINE)


def pages():
    """Every Markdown file of the project."""
    places = [ROOT, *(ROOT / name for name in (*PACKAGES, "tests", "docs"))]
    return sorted({*ROOT.glob("*.md"), *(page for place in places[1:] for page in place.rglob("*.md"))})


def blocks(page, language, *, needs_vehicle=False):
    """The fenced blocks of a page in a language, without indentation."""
    found = []
    for indent, mark, name, body in _FENCE.findall(page.read_text(encoding="utf-8")):
        if name == language and bool(mark) is needs_vehicle:
            found.append(re.sub(f"^{indent}", "", body, flags=re.MULTILINE))
    return found


def links(page):
    """Targets of a page's links and pictures that point into the project, as (path, anchor)."""
    text = _FENCE.sub("", page.read_text(encoding="utf-8"))
    targets = [target for target in [*_LINK.findall(text), *references(page).values()] if "://" not in target]
    return [tuple(target.partition("#")[::2]) for target in targets]


def references(page):
    """Targets of a page's reference links, by name."""
    return dict(_REFERENCE.findall(page.read_text(encoding="utf-8")))


def anchors(page):
    """The anchors of a page's headings."""
    headings = re.findall(r"^#+ (.*)$", _FENCE.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def commands():
    """Every command line shown in a sh block, and its page."""
    return [
        (page.relative_to(ROOT).as_posix(), line.strip())
        for page in pages()
        for block in blocks(page, "sh")
        for line in block.splitlines()
        if line.strip() and not line.strip().startswith("#")
    ]
