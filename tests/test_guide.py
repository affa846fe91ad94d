"""What the guide says can be done as it stands there."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import simrail
from simrail.cli.main import call
from simrail.estimation.estimate import description_of, estimator_class, registered
from simrail.scenario.file_keys import keys_of

DOCS = Path(__file__).parents[1] / "docs"
PAGES = sorted(DOCS.glob("*.md"))


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)


def test_python_blocks_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str], own_cache: None
) -> None:
    """The same lines; the scenario that they load ends sooner."""
    load: Callable = simrail.load_scenario
    short = partial(load, overrides=["ride.end_m=60.0", "ride.rest_s=4.0"])
    monkeypatch.setattr(simrail, "load_scenario", short, raising=False)
    monkeypatch.chdir(tmp_path)
    assert call(["new", "estimator", "my_filter"]) == 0  # which a block goes on with
    monkeypatch.syspath_prepend(str(tmp_path))
    for page in PAGES:
        for block in blocks(page, "python"):
            exec(compile(block, str(page), "exec"), {})
    assert "Estimate of IMU axle" in capsys.readouterr().out
    assert (tmp_path / "attitude.svg").is_file()


def toml_blocks(page: Path) -> list[str]:
    """Fenced ones, and indented ones that begin with a table."""
    text = page.read_text()
    indented = re.findall(r"^((?:    .*\n|\n)+)", text, re.MULTILINE)
    shown = [block for block in indented if re.match(r"\s+\[[\w\[.]+\]+", block)]
    return [*blocks(page, "toml"), *(re.sub(r"^    ", "", block, flags=re.MULTILINE) for block in shown)]


KNOWN = {(key.table, key.name) for kind in ("scenario", "ride") for key in keys_of(kind)}


def keys_in(table: dict, path: str = "") -> Iterator[tuple[str, str]]:
    """Tables, as `keys_of` shows them, and their keys."""
    for name, value in table.items():
        inside = [one for one in (value if isinstance(value, list) else [value]) if isinstance(one, dict)]
        full = f"{path.strip('[]')}.{name}" if path else name
        if inside and not (path and (path, name) in KNOWN):
            for one in inside:
                yield from keys_in(one, f"[[{full}]]" if isinstance(value, list) else f"[{full}]")
        elif path:
            yield path, name


def test_keys_of_toml_blocks_are_known() -> None:
    pages = [*PAGES, DOCS.parent / "README.md"]
    shown = {page.name: list(keys_in(tomllib.loads(block))) for page in pages for block in toml_blocks(page)}
    assert len(shown) >= 4
    for page, keys in shown.items():
        assert set(keys) <= KNOWN, page


def test_every_page_is_in_the_table_of_contents() -> None:
    listed = re.findall(
        r"<(\S+)>$", (DOCS / "index.md").read_text().rpartition("```{toctree}")[2], re.MULTILINE
    )
    made = {"validation"}  # by docs/generated.py
    assert {page.stem for page in PAGES} | made <= {*listed, "index"}


@pytest.fixture
def docs_modules(monkeypatch: pytest.MonkeyPatch) -> None:
    """What `docs/conf.py` puts on the path."""
    pytest.importorskip("numpydoc", reason='pip install -e ".[docs]"')
    monkeypatch.syspath_prepend(str(DOCS))


CASES = tomllib.loads((DOCS / "methods.toml").read_text())
SHIPPED = sorted(name for name, entry in registered().items() if entry.value.startswith("simrail."))


def test_every_method_has_figures_equations_and_something_that_it_is_bad_at() -> None:
    assert sorted(CASES) == SHIPPED
    for name, case in CASES.items():
        text = (DOCS / "method_equations" / f"{name}.md").read_text()
        assert "$$" in text or "\\begin{align" in text, name
        assert case["bad"], name
        for one in [*case.get("good", []), *case["bad"]]:
            # Its numbers are those of the run: but for units of wavelength it holds none.
            assert not re.search(r"\d", re.sub(r"\bD[0-3]\b|95 %", "", one["says"])), one["says"]
            assert ("than" in one) != ("limit" in one), one["says"]


def test_every_option_is_described_and_everything_cited_can_be_copied(docs_modules: None) -> None:
    import method_pages

    for name in SHIPPED:
        case = CASES[name]
        assert method_pages.options(name)  # a KeyError names an option that no docstring has
        about = description_of(estimator_class(name)(**case.get("options", {})))
        copied = method_pages.citations(about)  # a ValueError names what the bibliography lacks
        assert copied.count("@") >= len(set(about.cites)), name


def test_a_sentence_that_the_ride_does_not_bear_out_ends_the_build(docs_modules: None) -> None:
    import method_runs

    class Told(method_runs.Method):
        def figure(self, quantity: str, *args: str, **more: str) -> float:
            return {"it": 0.02, "the other": 0.05}[self.label]

    own, other = (Told(label, "Vqf", (), "curve") for label in ("it", "the other"))
    words = {"says": "{own} and not {other}", "quantity": "roll", "than": "the other"}
    assert method_runs.said(words, own, {"the other": other}, good=True) == "0.02° and not 0.05°"
    with pytest.raises(ValueError, match="not borne out"):
        method_runs.said(words, own, {"the other": other}, good=False)
    with pytest.raises(ValueError, match="not borne out"):
        method_runs.said({**words, "limit": 0.01}, own, {"the other": own}, good=True)


@pytest.mark.long
def test_a_figure_is_of_the_run_and_needs_no_network(docs_modules: None) -> None:
    """Its error is that of the score, drawn for a desk and for a phone."""
    import method_runs

    page = method_runs.made("DesignAngles", CASES["DesignAngles"])
    own = method_runs.Method("it", "DesignAngles", (), "curve")
    run = method_runs.run_of("curve")
    true = run.reference.motion["roll_rad"].to_numpy()
    rms = np.rad2deg(np.sqrt(np.mean((own.estimate().states["roll_rad"].to_numpy() - true) ** 2)))
    assert f"| roll, ° | {method_runs.number(rms)} |" in page["scores"]
    assert page["shape"].count("<svg") == page["beside"].count("<svg") == 2
    assert "estimated" in page["shape"]
    assert not page["has_interval"]
    assert "http" not in page["shape"].replace("http://www.w3.org", "")


@pytest.mark.slow
def test_the_guide_is_built_without_a_warning(tmp_path: Path) -> None:
    build = pytest.importorskip("sphinx.cmd.build", reason='pip install -e ".[docs]"')
    arguments = ["-q", "-W", "--keep-going", "-d", str(tmp_path / "trees"), str(DOCS), str(tmp_path / "html")]
    assert build.main(arguments) == 0
    assert "wavelengths_m" in (tmp_path / "html" / "keys" / "scenario.html").read_text()
