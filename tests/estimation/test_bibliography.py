"""Where methods come from: every method that is shipped is in the table, and its entries are BibTeX."""

from __future__ import annotations

import re

import pytest

from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.estimation.bibliography import OWN, SOURCES, citations, entries
from simrail.estimation.estimate import estimator_class, registered


@pytest.mark.parametrize("name", registered())
def test_every_source_of_a_shipped_method_is_known(name: str) -> None:
    assert set(getattr(estimator_class(name), "cites", ())) <= set(SOURCES)


@pytest.mark.parametrize("key", SOURCES)
def test_an_entry_is_whole(key: str) -> None:
    text = SOURCES[key].bibtex
    body = re.sub(r"^%.*\n", "", text)
    assert re.match(rf"@(article|inproceedings|techreport|misc){{{key},\n", body)
    assert body.count("{") == body.count("}") and body.endswith("\n}")
    assert body.isascii(), "what old LaTeX cannot read is written as a command"
    assert "author = " in body and "title = " in body
    # What was not looked up says so above itself.
    assert ("doi = " in body) != text.startswith("%")


def test_strange_sources_stand_as_they_are_and_each_is_printed_once() -> None:
    told = citations([("mine", ("A thesis of 2024", "hidalgo")), ("none", ())])
    assert told[0].words == f"A thesis of 2024; {SOURCES['hidalgo'].words}"
    assert told[0].bibtex == SOURCES["hidalgo"].bibtex and told[1].words == OWN and told[1].bibtex == ""
    shared = citations([("one", ("hidalgo",)), ("two", ("hidalgo", "briales_2021")), ("three", ("hidalgo",))])
    assert [one.method for one in shared] == ["one, three", "two"]
    text = entries([("hidalgo", "briales_2021"), ("briales_2021",), ("A thesis",)])
    assert text.count("@") == 2 and text.index("briales_2021") < text.index("hidalgo")


def test_the_list_prints_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["list", "estimators", "--bibtex"]) == DONE
    said = capsys.readouterr().out
    assert "% AttitudeEkf: Briales, Urda and Escalona 2021" in said and "@article{briales_2021," in said
    assert call(["list", "tracks", "--bibtex"]) == BAD_INPUT
