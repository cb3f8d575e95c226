"""A page of results that several commands write a section of each: who writes one keeps those of the others."""


def kept_from(page: str, heading: str) -> str:
    """What a page has from a heading on; "" without it."""
    at = page.find(heading)
    return "" if at < 0 else f"\n{page[at:]}"


def with_section(page: str, heading: str, section: str) -> str:
    """A page whose section of a heading is another, or that has it at its end now."""
    at = page.find(heading)
    if at < 0:
        return f"{page}\n{section}"
    after = page.find("\n## ", at + len(heading))
    return f"{page[:at]}{section}" + ("" if after < 0 else page[after:])
