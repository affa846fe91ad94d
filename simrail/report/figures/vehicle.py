"""Figures of a vehicle: profile pair, contact over the lateral shift, conicity, root locus."""

import numpy as np
from matplotlib.figure import Figure

from simrail.report.figures.canvas import (
    INK,
    LEFT_IN,
    MUTED,
    add_panel,
    is_narrow,
    look,
    panels,
    to_svg,
    width_in,
)
from simrail.report.tables.vehicle_text import MOST_HZ
from simrail.vehicle.contact.contact_pair import incline
from simrail.vehicle.contact.profile_files import profiles_of
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.stability import SLOWEST_HZ
from simrail.vehicle.study import Conicity, VehicleStudy

_LEFT, _RIGHT, _THIRD = "#0072B2", "#D55E00", "#009E73"
_GAUGE_DEPTH_M = 0.014
_MOST_HZ = 20.0
_PAIR_IN = 3.32
_BAR_IN = 0.78
"""Room for the bar of colours beside a panel: the bar, its numbers and what they are."""


def pair_figure(model: VehicleModel, contact: Conicity) -> str:
    """The left wheel on its rail, to scale, in mm: seen from behind, the middle of the track to the right."""
    pair = model.wheel_rail
    wheel, rail = profiles_of(pair)
    size = contact.scale
    head = incline(rail, pair.rail_inclination, gauge_depth_m=_GAUGE_DEPTH_M * contact.scale)
    # Abscissae from the tape circle, outward; the rail's from its own top.
    offset = pair.tape_circle_half_m - 0.5 * pair.gauge_m + head.gauge_abscissa_m
    e = np.linspace(head.spline.x[0], head.spline.x[-1], 400)
    middle = len(contact.rest.y_m) // 2
    at = float(contact.abscissa_m[middle, 0])
    lift = float(head.depth(np.array([at + offset]))[0])
    touch = float(np.interp(at, wheel.lateral_m, wheel.depth_m))
    rail_z = -1e3 * (head.depth(e) - lift)
    wheel_z = -1e3 * (wheel.depth_m - touch)
    rail_y, wheel_y = -1e3 * (e - offset), -1e3 * wheel.lateral_m
    floor, roof = min(rail_z.min(), wheel_z.min()) - 4.0 * size, max(wheel_z.max(), 0.0) + 14.0 * size
    with look():
        wide = width_in() - LEFT_IN - 0.2
        # To scale: on a phone all of the width, and as tall as that asks for.
        ends = np.concatenate([rail_y, wheel_y])
        tall = min(wide * (roof - floor) / (1.05 * float(np.ptp(ends))), _PAIR_IN)
        centre, reach = 0.5 * (ends.min() + ends.max()), 0.5 * (roof - floor) * wide / tall
        figure = Figure(figsize=(width_in(), tall + 0.68))
        axis = add_panel(figure, LEFT_IN, 0.52, wide, tall)
        axis.fill_between(rail_y[::-1], rail_z[::-1], floor, color="#dfe4ea", lw=0)
        axis.plot(rail_y, rail_z, color=MUTED, lw=1.6)
        axis.fill_between(wheel_y[::-1], wheel_z[::-1], roof, color="#dbe9f4", lw=0)
        axis.plot(wheel_y, wheel_z, color=_LEFT, lw=1.6)
        axis.plot([-1e3 * at], [0.0], marker="o", ms=6, mfc="white", mec=_RIGHT, mew=1.6, zorder=5)
        place = (float(wheel_y.min()) + 3.0 * size, roof - 3.0 * size)
        axis.annotate(f"wheel {wheel.name}", place, va="top", ha="left", color=_LEFT)
        place = (float(rail_y.mean()), floor + 3.0 * size)
        axis.annotate(f"rail {rail.name}", place, va="bottom", ha="center", color=MUTED)
        below = "from the tape circle" + (", mm" if is_narrow() else " towards the middle of the track, mm")
        axis.set(
            xlim=(centre - reach, centre + reach),
            ylim=(floor, roof),
            xlabel=below,
            ylabel="height, mm" if is_narrow() else "height over the contact, mm",
        )
        return to_svg(figure, description=f"Wheel {wheel.name} in contact with rail {rail.name}")


def shift_figure(contact: Conicity) -> str:
    """Place and angle of the contact and the rolling radius difference over the lateral shift."""
    y = 1e3 * contact.rest.y_m
    with look():
        figure, axes = panels([1.5, 1.5, 1.5])
        for k, (side, colour) in enumerate((("left wheel", _LEFT), ("right wheel", _RIGHT))):
            axes[0].plot(y, 1e3 * contact.abscissa_m[:, k], color=colour, label=side, lw=1.5)
            angle = np.rad2deg(np.arctan(np.abs(contact.slope[:, k])))
            axes[1].plot(y, angle, color=colour, lw=1.5)
        difference = 1e3 * (contact.rest.radius_left_m - contact.rest.radius_right_m)
        axes[2].plot(y, difference, color=_THIRD, lw=1.5)
        axes[2].axhline(0.0, color="#b8bec8", lw=0.7, zorder=-1)
        words = ("contact, mm", "contact angle, \N{DEGREE SIGN}", "radius difference, mm")
        for axis, label in zip(axes, words, strict=True):
            axis.set_ylabel(label)
        axes[0].legend(loc="lower left", bbox_to_anchor=(-0.005, 1.0), ncols=2, borderaxespad=0.15)
        axes[2].set(xlabel="lateral shift of the wheelset, mm", xlim=(float(y[0]), float(y[-1])))
        return to_svg(figure, description="Contact of both wheels over the lateral shift of the wheelset")


def conicity_figure(contact: Conicity) -> str:
    """Equivalent conicity over the amplitude."""
    with look():
        figure, (axis,) = panels([1.9], top_in=0.15)
        axis.plot(1e3 * contact.amplitude_m, contact.equivalent, color=_LEFT, lw=1.6, marker="o", ms=4)
        at = 3.0 * contact.scale
        axis.axvline(at, color=MUTED, lw=0.9, ls=(0, (4, 3)))
        text, place = f"{contact.at_3_mm:.3f} at {at:.2g} mm", (at, contact.at_3_mm)
        axis.annotate(text, place, (8, -16), textcoords="offset points", color=INK)
        axis.set(ylim=(0.0, None), xlim=(0.0, None), ylabel="equivalent conicity", xlabel="amplitude, mm")
        return to_svg(figure, description="Equivalent conicity over the amplitude")


def locus_figure(study: VehicleStudy) -> str:
    """Eigenvalues coloured by speed, and the smallest damping ratio over the speed."""
    speed = 3.6 * study.locus.speed_mps
    values = study.locus.eigenvalues_1ps
    with look():
        figure = Figure(figsize=(width_in(), 6.7))
        wide = width_in() - LEFT_IN - 0.2
        plane = add_panel(figure, LEFT_IN, 2.75, wide - _BAR_IN, 3.75)
        below = add_panel(figure, LEFT_IN, 0.54, wide, 1.47)
        scale = add_panel(figure, LEFT_IN + wide - _BAR_IN + 0.1, 2.75, 0.11, 3.75)
        frequency = values.imag / (2.0 * np.pi)
        shown = (frequency > SLOWEST_HZ) & (frequency < _MOST_HZ) & (values.real > -40.0)
        tint = np.broadcast_to(speed[:, None], values.shape)
        marks = plane.scatter(
            values.real[shown], frequency[shown], c=tint[shown], s=9, cmap="plasma", linewidths=0
        )
        bar = figure.colorbar(marks, cax=scale)
        bar.set_label("speed, km/h")
        bar.outline.set_visible(False)
        plane.axvline(0.0, color=INK, lw=0.9, ls=(0, (4, 3)))
        plane.set(ylim=(0.0, _MOST_HZ), xlabel="real part, 1/s", ylabel="frequency, Hz")
        counts = (frequency > SLOWEST_HZ) & (frequency < MOST_HZ)
        damping = np.where(counts, -values.real / np.maximum(np.abs(values), 1e-9), np.inf).min(axis=1)
        below.plot(speed, 100.0 * damping, color=_LEFT, lw=1.6)
        below.axhline(0.0, color=INK, lw=0.9, ls=(0, (4, 3)))
        if study.critical is not None and study.critical.speed_mps is not None:
            below.axvline(3.6 * study.critical.speed_mps, color=_RIGHT, lw=1.1)
        most = max(1.15 * 100.0 * float(damping.max()), 1.0)
        below.set(xlim=(0.0, float(speed[-1])), ylim=(None, most))
        below.set(xlabel="speed, km/h", ylabel="least damping, %")
        return to_svg(figure, description="Root locus over the speed, and the smallest damping ratio")
