"""What a recording says of its devices: IMU and way, axes alone, a second IMU, a magnetometer's clock."""

from dataclasses import replace

from threadpoolctl import threadpool_limits

from simrail.recording.evidence.axes import are_columns, weigh_axes
from simrail.recording.evidence.clipped import weigh_clipped
from simrail.recording.evidence.exchanged import weigh_exchange
from simrail.recording.evidence.field_clock import weigh_field_clock
from simrail.recording.evidence.finding import Finding
from simrail.recording.evidence.judge import Evidence, weigh
from simrail.recording.evidence.second import weigh_second
from simrail.recording.recording import Recording

MANY = 3
"""So many figures that are wrong at once have one cause that is none of them: two mistakes in one file are
rare, three are not met."""


def weigh_all(recording: Recording) -> Evidence:
    """What a recording says of itself.

    Single axes are judged where no device as a whole is surely wrong; and where each of them follows the line
    with a sign of its own, they are what is wrong.

    Parameters
    ----------
    recording : Recording
        A ride that has passed `simrail.recording.check_form.check_recording`.
    """
    first = weigh(recording)
    axes = weigh_axes(recording, first.single)
    if any(finding.wrong for finding in (*first.findings, *axes)):
        exchanged = weigh_exchange(recording)
        if exchanged is not None:
            first, axes = exchanged, ()
    are_signs = False
    is_single = first.single is not None and bool(first.single.free)
    if any(finding.verdict == "surely wrong" for finding in first.findings):
        slopes = weigh_axes(recording)
        # Where something changes within the ride, a slope over all of it says nothing.
        is_changed = first.single is not None and first.single.changed_s is not None
        are_signs = not is_changed and are_columns(slopes)
        if are_signs:
            first, axes = (
                replace(first, findings=tuple(_unjudged(finding) for finding in first.findings)),
                slopes,
            )
        elif not is_single:
            axes = ()
    clipped = weigh_clipped(recording)
    if any(finding.key.startswith("unsigned") for finding in clipped):
        why = "an axis has lost its sign"
        first = replace(first, findings=tuple(_together(finding, why) for finding in first.findings))
        axes = tuple(_together(finding, why) for finding in axes)
    elif not are_signs:
        first, axes = _at_once(first, axes)
    cut = {f"alone_{finding.key.partition('_')[2]}": finding for finding in clipped}
    axes = tuple(_cut(finding, cut[finding.key]) if finding.key in cut else finding for finding in axes)
    beside = (*axes, *clipped, *weigh_second(recording, first))
    with threadpool_limits(1):  # as for the fits: its matrices are small, too
        beside += weigh_field_clock(recording)
    return replace(first, findings=first.findings + beside) if beside else first


def _at_once(first: Evidence, axes: tuple[Finding, ...]) -> tuple[Evidence, tuple[Finding, ...]]:
    """The findings, but for so many that are wrong at once that none of them can be believed."""
    wrong = [finding for finding in (*first.findings, *axes) if finding.wrong]
    if len(wrong) < MANY:
        return first, axes
    shown = ", ".join(f"{finding.name} {finding.shown}" for finding in wrong)
    mixed = Finding(
        "figures that are wrong at once",
        "at_once",
        float(len(wrong)),
        1.0,
        0.0,
        "1",
        "all of the ride",
        "surely wrong" if any(finding.verdict == "surely wrong" for finding in wrong) else "likely wrong",
        f"no single mistake explains this ride ({shown}): mending these figures would only hide it",
        field="imu",
        remedy="look for what changes within the ride: a filter of the logger, an offset that drifts, parts "
        "missing or in another order, two rides in one file, a device that came loose; or another track",
    )
    axes = tuple(_together(finding) for finding in axes)
    findings = tuple(_together(finding) for finding in first.findings)
    return replace(first, findings=(*findings, mixed)), axes


def _together(finding: Finding, why: str = "several figures are wrong at once") -> Finding:
    """A finding that is wrong together with many others, or by another one."""
    if not finding.wrong:
        return finding
    return replace(finding, verdict="could not be judged", why=why, setting="", remedy="")


def _cut(finding: Finding, of: Finding) -> Finding:
    """A finding of an axis that is cut off, or without its sign: its factor follows from that."""
    why = "the axis is cut off at the end of its range"
    if of.key.startswith("unsigned"):
        why = "the axis has lost its sign"
    return replace(finding, rests_on="nothing", verdict="could not be judged", why=why, setting="", remedy="")


def _unjudged(finding: Finding) -> Finding:
    """A finding of a device as a whole, whose columns have different signs."""
    return replace(
        finding,
        rests_on="nothing",
        verdict="could not be judged",
        why="single columns of the IMU have the other sign",
        setting="",
        remedy="",
    )
