"""A page of several sections, of which one is written anew."""

from bench.page_section import kept_from, with_section

PAGE = "# Page\n\nfirst\n\n## A\n\nold\n\n## B\n\nkept\n"


def test_a_section_is_exchanged_and_the_others_stay():
    assert with_section(PAGE, "## A", "## A\n\nnew\n") == "# Page\n\nfirst\n\n## A\n\nnew\n\n## B\n\nkept\n"
    assert with_section(PAGE, "## B", "## B\n\nnew\n") == "# Page\n\nfirst\n\n## A\n\nold\n\n## B\n\nnew\n"
    assert with_section(PAGE, "## C", "## C\n\nnew\n") == PAGE + "\n## C\n\nnew\n"


def test_what_follows_a_heading_is_kept():
    assert kept_from(PAGE, "## A") == "\n" + PAGE[PAGE.find("## A") :]
    assert kept_from(PAGE, "## C") == ""
