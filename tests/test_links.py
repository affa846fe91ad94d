"""What README, CONTRIBUTING and the guide point to is there: files, places in them, and pages as built."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

from simrail.estimation.estimate import registered
from simrail.scenario.file_keys import FILES

ROOT = Path(__file__).parents[1]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted(ROOT.glob("docs/*.md")),
]
MADE = {
    *(f"docs/methods/{name}.md" for name in ("index", *registered())),
    *(f"docs/keys/{name}.md" for name in ("index", *FILES)),
    *("docs/api/index.rst", "docs/validation.md"),
}
"""Pages that docs/generated.py writes."""


def without_code(text: str) -> str:
    return re.sub(r"^```.*?^```|`[^`\n]*`", "", text, flags=re.DOTALL | re.MULTILINE)


def links_of(text: str) -> list[str]:
    """Targets of links and pictures that do not leave the repository."""
    found = re.findall(r"\]\(([^)\s]+)(?:\s+\"[^\"]*\")?\)", without_code(text))
    return [link for link in found if not re.match(r"[a-z]+:", link)]


def anchors_of(text: str) -> set[str]:
    """Anchors that the headings of a page have, as GitHub and the guide make them."""
    headings = re.findall(
        r"^#+ (.*)$", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE), re.MULTILINE
    )
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def broken(page: Path, text: str, root: Path = ROOT) -> list[str]:
    lines = []
    for link in links_of(text):
        place, _, anchor = link.partition("#")
        target = (page.parent / place).resolve() if place else page
        if not target.exists() and (
            not target.is_relative_to(root) or target.relative_to(root).as_posix() not in MADE
        ):
            lines.append(f"{link}: no such file")
        elif anchor and target.is_file() and anchor not in anchors_of(target.read_text(encoding="utf-8")):
            lines.append(f"{link}: no such heading")
    return lines


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    assert broken(page, page.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("page", PAGES[:2] + PAGES[3:], ids=lambda page: page.name)
def test_files_that_are_named_are_there(page: Path) -> None:
    """Paths of the repository in code, such as `results/reference/which_imu.csv`."""
    rooms = "docs|estimators|results/reference|scenarios|simrail|tests"
    named = re.findall(
        rf"(?<![\w/.])((?:{rooms})/[\w/.]*\.(?:py|md|toml|csv|png|bib|json))",
        page.read_text(encoding="utf-8"),
    )
    assert [path for path in named if "NAME" not in path and not (ROOT / path).is_file()] == []


def test_a_link_that_leads_nowhere_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# One heading\n")
    text = "[a](page.md#one-heading) [b](page.md#another) [c](gone.md) [d](https://x.org) `[e](code.md)`"
    assert broken(page, text) == ["page.md#another: no such heading", "gone.md: no such file"]


def test_the_checker_of_built_pages_finds_what_is_gone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = importlib.util.spec_from_file_location("links", ROOT / ".ci" / "links.py")
    assert spec is not None
    assert spec.loader is not None
    links = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(links)
    (tmp_path / "two.html").write_text('<p id="here"><a href="https://x.org/y#z">x</a>')
    good = '<a href="two.html#here"></a><a href="#"></a><img src="data:image/png;base64,AA">'
    (tmp_path / "one.html").write_text(good)
    assert links.main([str(tmp_path)]) == 0
    (tmp_path / "one.html").write_text(good + '<a href="two.html#there"></a><a href="three.html"></a>')
    assert links.main([str(tmp_path)]) == 1
    told = capsys.readouterr().out
    assert "two.html#there: there is no such place" in told
    assert "three.html: there is no such file" in told
    assert links.external_links(tmp_path) == {"https://x.org/y": ["two.html"]}
