"""Every refusal in the sources says what would be accepted, and what to do about it."""

from __future__ import annotations

import ast

import pytest

from simrail.core.errors import MOST_SHOWN, InputError, one_line
from simrail.core.source_hash import source_folders


def refusals() -> list[tuple[str, set[str | None]]]:
    """Where an `InputError` is made, and which of its words it is given."""
    found = []
    for folder in source_folders():
        for path in sorted(folder.rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "InputError":
                    words = {keyword.arg for keyword in node.keywords}
                    found.append((f"{path.name}:{node.lineno}", words))
    return found


def test_every_refusal_says_what_would_be_accepted() -> None:
    """What to do follows from the limit where nothing else is said (`InputError.line`)."""
    all_of_them = refusals()
    assert len(all_of_them) > 400
    assert [place for place, words in all_of_them if "limit" not in words and None not in words] == []


@pytest.mark.parametrize(
    ("limit", "remedy"), [("one of a, b", "choose one of them"), ("> 0 m", "keep to the limit")]
)
def test_a_limit_alone_says_what_to_do(limit: str, remedy: str) -> None:
    assert str(InputError("is wrong", limit=limit)).endswith(f"; limit: {limit}; remedy: {remedy}")


def test_what_was_found_is_cut_and_shown_in_one_line() -> None:
    error = InputError(
        "is\nwrong", file="a\x1b[31m.toml", field="k\r" + "y" * 5000, value="\u202e" + "v" * 10**6, limit="x"
    )
    said = str(error)
    assert said.isprintable() and "\n" not in said and len(said) < 4 * MOST_SHOWN
    assert "a\\x1b[31m.toml: k\\ry" in said and "is\\nwrong" in said and "\\u202evvv" in said
    assert "(1000008 characters)" in said and "(5002 characters)" in said
    assert one_line("50\xa0m", 20) == "50 m"
    assert one_line("\ud800", 20) == "\\ud800", "no terminal takes half a letter"
