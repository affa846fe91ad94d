"""Results beside other results: read back, shown as rows of their own, or refused before anything runs."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pandas as pd
import pytest
from short_line import SHORT_LINE

from simrail.campaign.stored_results import read_results
from simrail.cli.main import BAD_INPUT, DONE, call

pytestmark = [pytest.mark.usefixtures("no_pictures_of_rides"), pytest.mark.long]

TEXT = (
    SHORT_LINE
    + """
[geometry]
own_bands = { paper = [3.0, 70.0] }
[[estimator]]
name = "smoother"
stands_for = "hand"
method = "TrajectorySmoother"
[[estimator]]
name = "zero_track"
stands_for = "zero"
method = "ZeroTrack"
"""
)

# The same rails in another band: which size a run is of, its band tells.
MODEL = TEXT.replace("[3.0, 70.0]", "[1.0, 7.0]").replace('"go"', '"out"').replace("seed = 3", "seed = 4")


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory, no_pictures_of_rides: None) -> Path:
    """A folder with the results of both sizes, the first beside the second."""
    here = tmp_path_factory.mktemp("beside")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(here)
        patch.setattr("simrail.ride.cache.cache_folder", lambda: here / "cache")
        (here / "full.toml").write_text(TEXT)
        (here / "model.toml").write_text(MODEL)
        assert call(["run", "model.toml", "--workers", "1"]) == DONE
        assert call(["run", "full.toml", "--workers", "1", "--beside", "results/model"]) == DONE
    return here


def rows_of_page(page: str) -> dict[str, list[str]]:
    """Cells of each row of the section's first table, by the row's label."""
    table = page.partition('id="paper"')[2].partition("</table>")[0]
    rows = re.findall(r"<tr.*?</tr>", table, flags=re.S)
    found = [
        [re.sub(r"<[^>]*>", "", cell).strip() for cell in re.findall(r"<t[hd].*?</t[hd]>", row, flags=re.S)]
        for row in rows
    ]
    return {row[0]: row[1:] for row in found if row}


def test_rows_of_both_sizes_stand_on_one_page(ran: Path) -> None:
    """Those of the other are the ones on its own page, and not those of this one."""
    both = rows_of_page((ran / "results/full/report.html").read_text(encoding="utf-8"))
    alone = rows_of_page((ran / "results/model/report.html").read_text(encoding="utf-8"))
    assert both["set by hand: ours, 1:10"] == alone["set by hand"]
    assert both["set by hand: ours, full size"] != alone["set by hand"]
    assert both["no IMU: ours, 1:10"] == alone["no IMU"]
    assert "set by hand" not in both and not any("ours" in label for label in alone)


def test_the_page_and_the_manifest_say_what_stands_beside(ran: Path) -> None:
    page = (ran / "results/full/report.html").read_text(encoding="utf-8")
    assert "with 1:10 beside it" in page and "results of model of 20" in page and "ride out" in page
    own, other = (
        json.loads((ran / f"results/{name}/manifest.json").read_text()) for name in ("full", "model")
    )
    assert own["beside"]["scenario_hash"] == other["scenario_hash"] != own["scenario_hash"]
    assert own["command"] == "simrail run full.toml --beside results/model", "a file of one's own by its path"
    assert "beside" not in other


@pytest.fixture
def here(ran: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(ran / "results" / "model", tmp_path / "model")
    (tmp_path / "full.toml").write_text(TEXT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def changed(folder: Path, **change: object) -> None:
    """Change what the manifest in a folder says; None takes a key away."""
    file = folder / "model" / "manifest.json"
    manifest = json.loads(file.read_text()) | change
    file.write_text(json.dumps({key: value for key, value in manifest.items() if value is not None}))


def _is_refused(beside: str, words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["run", "full.toml", "--beside", beside]) == BAD_INPUT
    said = capsys.readouterr().err
    assert all(word in said for word in words), said
    assert not Path("results").exists() and "Traceback" not in said


def test_no_results_are_refused(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _is_refused("nowhere", ["--beside", "nowhere", "no finished results"], capsys)
    (here / "model" / "scores.parquet").write_text("no table")
    _is_refused("model", ["--beside", "no finished results", "run that scenario first"], capsys)


def test_what_would_be_replaced_is_refused(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (here / "model" / "report.html").read_bytes()
    assert call(["run", "full.toml", "--beside", "model", "--out", "../" + here.name + "/model"]) == BAD_INPUT
    assert "--beside" in capsys.readouterr().err
    assert (here / "model" / "report.html").read_bytes() == before and not Path("results").exists()


def test_results_of_one_size_are_told_apart_by_their_names(here: Path) -> None:
    """The size and the band of figures and coverage are those of the scenario's own band, as in the table."""
    (here / "again.toml").write_text(MODEL)
    assert call(["run", "again.toml", "--workers", "1", "--beside", "model"]) == DONE
    page = Path("results/again/report.html").read_text(encoding="utf-8")
    rows = rows_of_page(page)
    assert rows["set by hand: ours, 1:10"] == rows["set by hand: ours, 1:10, model"]
    assert "The track here is 1:10" in page and "with 1:10, model beside it" in page


@pytest.mark.parametrize("key", ["scenario", "scenario_text", "settings", "seed"])
def test_a_manifest_that_lacks_something_is_refused(
    here: Path, capsys: pytest.CaptureFixture[str], key: str
) -> None:
    changed(here, **{key: None})
    _is_refused("model", ["--beside", f"does not say {key}"], capsys)


@pytest.mark.parametrize(("table", "column"), [("scores", "band"), ("cells", "case")])
def test_tables_of_an_older_simrail_are_refused(
    here: Path, capsys: pytest.CaptureFixture[str], table: str, column: str
) -> None:
    file = here / "model" / f"{table}.parquet"
    pd.read_parquet(file).drop(columns=column).to_parquet(file, index=False)
    _is_refused("model", ["--beside", f"does not say {column}"], capsys)


def test_former_results_are_read_with_what_was_set(here: Path) -> None:
    changed(here, seed=77, settings=["ride.out.end_m=300.0"])
    spec = read_results(here / "model", field="x", remedy="y").scenario().spec
    assert spec.seed == 77 and spec.ride[0].end_m == 300.0


def test_another_publication_is_refused(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changed(here, scenario_text=MODEL.replace("gonzalez_2023", "briales_2021"))
    _is_refused("model", ["--beside", "no place for results of model", "gonzalez_2023"], capsys)


def test_a_scenario_that_is_not_read_any_more_is_refused(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changed(here, scenario_text=MODEL.replace("seed = 4", "seed = 4\nsede = 5"))
    _is_refused("model", ["manifest.json", "sede"], capsys)
