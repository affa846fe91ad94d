"""Lessons as scripts: their claims hold, and do not where what they speak of is made wrong."""

import importlib.util
import socket
import subprocess
import sys
import time
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from simrail.cli.main import call
from simrail.lessons import LESSONS, notebook, teacher_page
from simrail.lessons.claims import Claim, ClaimError, about, conclusion, insist, table
from simrail.lessons.serve import free_port

OTHERS = [pytest.param(name, marks=pytest.mark.slow) for name in LESSONS if name != "drift"]


def module_of(name: str) -> ModuleType:
    """A notebook as a module of its own, read anew."""
    spec = importlib.util.spec_from_file_location(f"lesson_{name}", notebook(name))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def claims_of(name: str) -> list[Claim]:
    """What a lesson claims when it is run, whether it holds or not."""
    with pytest.MonkeyPatch.context() as patch:
        # The notebook's last cell would end the run; here all claims are wanted.
        patch.setattr("simrail.lessons.claims.insist", lambda claims: None)
        _, names = module_of(name).app.run()
    return list(names["claims"])


@pytest.mark.parametrize("name", ["drift", *OTHERS])
def test_claims_hold(name):
    claims = claims_of(name)
    assert len(claims) >= 3
    assert [claim.line for claim in claims if not claim.holds] == []
    # A bound that nothing could miss claims nothing.
    assert all(claim.high - claim.low < 1e3 * max(abs(claim.value), 1e-3) for claim in claims)


def broken(name: str) -> list[str]:
    return [claim.words for claim in claims_of(name) if not claim.holds]


def test_drift_with_half_the_noise_is_no_longer_true(monkeypatch):
    import simrail.sensors.imu as imu

    whole = imu.add_noise

    def halved(samples, grade, kind, streams):
        before = samples.copy()
        whole(samples, grade, kind, streams)
        samples[:] = before + 0.5 * (samples - before)

    monkeypatch.setattr(imu, "add_noise", halved)
    assert any("Allan deviation at 1 s is N" in words for words in broken("drift"))


def test_a_claim_that_does_not_hold_ends_the_script(capsys):
    good, bad = about("two and two", 4.0, 4.0, 0.01), Claim("a third", 0.5, 0.3, 0.4, "m")
    insist([good])
    with pytest.raises(ClaimError, match="a third"):
        insist([good, bad])
    assert "DOES NOT HOLD: a third: 0.5 m" in capsys.readouterr().out
    assert table([good, bad]).count("\n") == 3
    with pytest.raises(ClaimError):
        conclusion([bad], script=True)
    assert "BALLOT" not in conclusion([bad], script=False)
    assert "a third" in conclusion([bad], script=False)


@pytest.mark.slow
def test_runs_as_a_script():
    run = subprocess.run([sys.executable, notebook("drift")], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("holds:") >= 3


def test_command_lists_and_refuses(capsys):
    assert call(["lesson"]) == 0
    assert all(title in capsys.readouterr().out for title in ["Why a filter drifts"])
    assert call(["lesson", "drfit"]) == 2
    err = capsys.readouterr().err
    assert "did you mean drift?" in err
    assert err.count("\n") == 1


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Commands that would serve a lesson."""
    calls: list[list[str]] = []
    monkeypatch.setattr(subprocess, "call", lambda command, **more: calls.append(command) or 0)
    return calls


def test_edit_opens_a_copy_and_keeps_what_is_there(here, served, capsys):
    shipped = notebook("drift").read_bytes()
    assert call(["lesson", "drift", "--edit"]) == 0
    assert (here / "lesson_drift.py").read_bytes() == shipped
    assert served[-1][-2:] == ["edit", "lesson_drift.py"]
    assert "wrote lesson_drift.py" in capsys.readouterr().out
    (here / "lesson_drift.py").write_text("# my own\n")
    assert call(["lesson", "drift", "--edit"]) == 0
    assert (here / "lesson_drift.py").read_text() == "# my own\n"
    assert "is there already" in capsys.readouterr().out
    assert notebook("drift").read_bytes() == shipped
    assert call(["lesson", "drift"]) == 0
    assert served[-1][2] == "simrail.lessons.serve"
    assert served[-1][4:6] == ["run", str(notebook("drift"))]
    assert int(served[-1][served[-1].index("--port") + 1]) > 0


def test_a_folder_of_the_same_name_is_not_what_a_lesson_imports(here, monkeypatch):
    """A checkout that was installed, not as editable, has a folder ``simrail`` without its estimators."""
    (here / "simrail").mkdir()
    (here / "simrail" / "__init__.py").write_text("raise ImportError('the wrong one')")
    ran = subprocess.run

    def imports(command: list[str], env: dict[str, str]) -> int:
        tried = [sys.executable, "-m", "simrail.lessons.claims"]
        assert ran(tried, capture_output=True, check=False).returncode == 1
        return ran(tried, capture_output=True, check=False, env=env).returncode

    monkeypatch.setattr(subprocess, "call", imports)
    assert call(["lesson", "drift"]) == 0


def test_an_edited_lesson_without_a_browser_asks_for_the_key_that_is_told(here, monkeypatch, capsys):
    served: list[list[str]] = []

    def serves(command: list[str], **more: object) -> int:
        served.append(command)
        with socket.create_server(("127.0.0.1", port)) as server:
            server.accept()
            time.sleep(0.2)
        return 0

    port = free_port()
    monkeypatch.setattr(subprocess, "call", serves)
    assert call(["lesson", "slip", "--edit", "--headless", "--port", str(port)]) == 0
    key = served[-1][served[-1].index("--token-password") + 1]
    assert f"http://127.0.0.1:{port}?access_token={key}" in capsys.readouterr().out
    assert len(key) > 10


def test_edit_in_a_folder_that_cannot_be_written_is_one_line(here, served, capsys, monkeypatch):
    monkeypatch.setattr(
        "simrail.core.atomic_files.whole_file", lambda file: (_ for _ in ()).throw(PermissionError(13, "no"))
    )
    assert call(["lesson", "drift", "--edit"]) == 2
    err = capsys.readouterr().err
    assert "the copy of the lesson cannot be written" in err
    assert err.count("\n") == 1
    assert served == []
    assert list(here.iterdir()) == []


def test_two_browsers_at_once_get_the_figures_that_one_gets():
    """Each has a thread of its own, and matplotlib has one look for all of them."""
    from concurrent.futures import ThreadPoolExecutor

    import matplotlib as mpl

    from simrail.lessons.figures import Line, Panel, svg_of

    def drawn(_: int) -> str:
        x = np.arange(3.0)
        return svg_of([Panel("m", [Line("a", x, x)])], x_label="s", description="a line")

    before = dict(mpl.rcParams)
    alone = drawn(0)
    with ThreadPoolExecutor(4) as crowd:
        figures = list(crowd.map(drawn, range(8)))
    assert [len(figure) for figure in figures] == [len(alone)] * 8
    assert dict(mpl.rcParams) == before


def test_a_figure_has_a_colour_for_every_variable_that_it_uses():
    """Where nobody gives one, a browser paints black: axes, words and the ground itself."""
    import re

    from simrail.lessons.figures import Line, Panel, draw
    from simrail.report.figures.canvas import LIGHT, by_itself

    x = np.arange(3.0)
    figure = draw([Panel("m", [Line("a", x, x)], spans=[(0.0, 1.0)])], x_label="s", description="a line")
    style, svg = figure.split("<svg", 1)
    assert "svg" in svg.split("<svg", 1)[1], "one for a desk, one for a phone"
    used = set(re.findall(r"var\(--(\w+)\)", svg))
    assert {"page", "ink", "line", "curve"} <= used
    assert used <= set(re.findall(r"--(\w+): ", style))
    assert used <= set(LIGHT)
    alone = by_itself(f"<svg{svg}")
    assert "var(--" not in alone
    assert "#ffffff" in alone


def test_a_figure_of_two_panels_names_first_what_is_in_the_first_and_counts_whole_devices():
    import re

    from simrail.lessons.figures import Line, Panel, svg_of

    x = np.arange(1.0, 5.0)  # which would be marked at each half
    parts = [Panel("m", [Line("first", x, x)]), Panel("m", [Line("second", x, x)])]
    svg = svg_of(parts, x_label="device", description="two panels")
    words = re.findall(r">([^<>\n]+)</text", svg)
    assert words.index("first") < words.index("second")
    assert words[words.index("second") + 1 : words.index("device")] == ["1", "2", "3", "4"]


def test_every_lesson_ends_alike():
    for name in LESSONS:
        text = notebook(name).read_text(encoding="utf-8")
        last = text.rpartition("@app.cell")[2]
        assert 'mo.md(conclusion(claims, script=mo.app_meta().mode == "script"))' in last, name


def test_every_lesson_has_its_notebook_and_a_place_on_the_teachers_page():
    words = teacher_page().read_text(encoding="utf-8")
    for name in LESSONS:
        assert notebook(name).is_file()
        assert f"simrail lesson {name}" in words


def test_shipped_ride_is_small_and_of_its_scenario():
    from simrail.lessons.rides import MOST_SHIPPED_BYTES, SHIPPED, short_ride

    assert sum(file.stat().st_size for file in SHIPPED.iterdir()) < MOST_SHIPPED_BYTES
    line = short_ride()
    assert set(line.truth.bodies) == {"front", "frame"}
    # The rails are laid again: the axle runs on them, so its height follows them.
    axle = line.truth.bodies["front"]
    place = line.place_m + axle.offset_m
    left, right = line.rails.rails(place)[:, [1, 3]].T
    height = axle.position[:, 2] - axle.height_m
    cant = line.truth.track.frame(place).position[:, 2]
    moving = slice(2000, -500)
    follows = np.corrcoef((height - cant)[moving], 0.5 * (left + right)[moving])[0, 1]
    assert follows > 0.99


@pytest.mark.slow
def test_curve_with_the_sign_of_the_compensation_turned_is_no_longer_true(monkeypatch):
    import simrail.estimators.attitude.ekf as ekf

    right = ekf.gravity_and_curves

    def turned(recording, **options):
        felt = recording.imu[["accel_x_mps2", "accel_y_mps2", "accel_z_mps2"]].to_numpy()
        left = right(recording, **options)
        return left._replace(force=2.0 * felt - left.force)

    monkeypatch.setattr(ekf, "gravity_and_curves", turned)
    assert any("compensated EKF in the curve" in words for words in broken("curve"))


@pytest.mark.slow
def test_baseline_that_reads_the_cant_the_wrong_way_is_no_longer_true(monkeypatch):
    from simrail.estimators.baselines import DesignAngles

    right = DesignAngles.estimate

    def turned(self, recording):
        estimate = right(self, recording)
        return replace(estimate, states=estimate.states.assign(roll_rad=-estimate.states["roll_rad"]))

    monkeypatch.setattr(DesignAngles, "estimate", turned)
    assert len(broken("baseline")) >= 2


@pytest.mark.slow
def test_slip_that_the_encoder_does_not_count_is_no_longer_true(monkeypatch):
    import simrail.sensors.measure as measure

    right = measure.sample_encoder
    monkeypatch.setattr(
        measure,
        "sample_encoder",
        lambda t, angle, spec, **more: right(t, angle, replace(spec, slip=()), **more),
    )
    assert any("lost by creepage times way" in words for words in broken("slip"))


@pytest.mark.slow
def test_interval_of_half_the_size_is_no_longer_true(monkeypatch):
    from simrail.estimators.attitude.ekf import AttitudeEkf

    right = AttitudeEkf.estimate

    def halved(self, recording):
        estimate = right(self, recording)
        states = estimate.states.assign(roll_sd_rad=0.5 * estimate.states["roll_sd_rad"])
        return replace(estimate, states=states)

    monkeypatch.setattr(AttitudeEkf, "estimate", halved)
    assert any("NEES within the bounds" in words for words in broken("interval"))


@pytest.mark.slow
def test_rails_by_a_smoother_that_does_not_smooth_are_no_longer_true(monkeypatch):
    from simrail.estimators.trajectory.smoother import TrajectorySmoother

    right = TrajectorySmoother.estimate
    monkeypatch.setattr(
        TrajectorySmoother,
        "estimate",
        lambda self, recording: right(replace(self, smoothed=False), recording),
    )
    assert any("halves a filter's error" in words for words in broken("rails"))
