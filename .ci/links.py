"""Links of the guide as it was built: every place that a page points to is there, and every anchor on it.

    python .ci/links.py FOLDER [--external]

FOLDER is what ``sphinx-build docs FOLDER`` wrote. Links that leave it are told with ``--external``: each is
asked for once, and those that cannot be reached are listed with the reason and the pages that name them.
Exit code 1 if a link within the guide leads nowhere, or one that was asked for is not there any more.
"""

from __future__ import annotations

import sys
import urllib.error
import urllib.request
from collections import defaultdict
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlsplit

GONE = (404, 410)
"""What a server says of a page that is not there; anything else may be the network, or a server that
answers browsers only."""

TIMEOUT_S = 15.0


class Page(HTMLParser):
    """Anchors of a page, and what it points to."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take in one tag."""
        for key, value in attrs:
            if value and (key == "id" or (tag == "a" and key == "name")):
                self.anchors.add(value)
            if value and key in ("href", "src"):
                self.links.append(value)


def pages_of(folder: Path) -> dict[Path, Page]:
    """The pages of a folder; what lies in ``_static`` belongs to the theme."""
    files = sorted(folder.rglob("*.html"))
    return {file: Page(file) for file in files if "_static" not in file.relative_to(folder).parts}


def broken_links(folder: Path) -> list[str]:
    """Links within a folder of pages that lead nowhere, one line each."""
    pages = pages_of(folder.resolve())
    lines = []
    for file, page in pages.items():
        for link in page.links:
            place, anchor = urldefrag(link)
            if urlsplit(link).scheme or link.startswith("//"):
                continue
            target = (file.parent / unquote(urlsplit(place).path)).resolve() if place else file
            target = target / "index.html" if target.is_dir() else target
            name = file.relative_to(folder.resolve())
            if not target.is_file():
                lines.append(f"{name}: {link}: there is no such file")
            elif anchor and target in pages and unquote(anchor) not in pages[target].anchors:
                lines.append(f"{name}: {link}: there is no such place on that page")
    return lines


def external_links(folder: Path) -> dict[str, list[str]]:
    """Pages that name each place elsewhere."""
    named = defaultdict(set)
    for file, page in pages_of(folder).items():
        for link in page.links:
            if urlsplit(link).scheme in ("http", "https"):
                named[urldefrag(link)[0]].add(file.relative_to(folder).as_posix())
    return {link: sorted(pages) for link, pages in sorted(named.items())}


def answer(link: str) -> tuple[bool, str]:
    """Whether a place may be there, and what it answered; "" for a page."""
    asked = urllib.request.Request(link, headers={"User-Agent": "Mozilla/5.0 (simrail guide)"})
    try:
        with urllib.request.urlopen(asked, timeout=TIMEOUT_S):
            return True, ""
    except urllib.error.HTTPError as error:
        return error.code not in GONE, f"answers {error.code}"
    except (OSError, ValueError) as error:
        return True, f"not reached: {getattr(error, 'reason', error)}"


def main(arguments: list[str]) -> int:
    """Check a folder; 0 if all is well."""
    folder = Path(next(word for word in arguments if not word.startswith("-")))
    lines = broken_links(folder)
    print("\n".join(lines) or f"every link within {folder} leads somewhere")
    failed = bool(lines)
    if "--external" in arguments:
        for link, pages in external_links(folder).items():
            there, words = answer(link)
            failed |= not there
            if words:
                print(f"{link}: {words} (in {', '.join(pages[:3])}{' ...' if len(pages) > 3 else ''})")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
