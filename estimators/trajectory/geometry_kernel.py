"""Compiled loops of the rails' geometry: where a body sees them, and how sure that is.

What comes of it, and over what places, is `simrail.estimators.trajectory.track_geometry`.
"""

from simrail.core.jit import FloatArray, IntArray, njit_borrowed, njit_inline
from simrail.core.sine import sine_cosine


@njit_borrowed
def rails_seen(
    design: FloatArray,
    states: FloatArray,
    seen: FloatArray,
    half_base: float,
    arms: FloatArray,
    rails: FloatArray,
) -> None:
    """Both rails from the body, in the axes of the track: A = R_design' R_body takes what is seen there.

    Parameters
    ----------
    design : ndarray (3, n)
        Roll, pitch and yaw of the track frame, rad.
    states : ndarray (n, 5)
        Those of the body, and its place y and z in the track frame, m.
    seen : ndarray (n, 2, 3) or (1, 2, 3)
        Left and right rail from the IMU, body axes, m; one row is that of all samples.
    half_base : float
        Half the distance of the rails, m.
    arms : ndarray (n, 2, 3), out
        From the IMU to left and right rail, track axes, m.
    rails : ndarray (n, 2, 2), out
        Their deviation from the design along y and z, m.
    """
    for k in range(states.shape[0]):
        sr, cr = sine_cosine(states[k, 0])
        sp, cp = sine_cosine(states[k, 1])
        sy, cy = sine_cosine(states[k, 2] - design[2, k])  # both turn about one vertical
        sr0, cr0 = sine_cosine(design[0, k])
        sp0, cp0 = sine_cosine(design[1, k])
        at = k if seen.shape[0] > 1 else 0
        for rail in range(2):
            x, y, z = seen[at, rail, 0], seen[at, rail, 1], seen[at, rail, 2]
            y, z = cr * y - sr * z, sr * y + cr * z
            x, z = cp * x + sp * z, cp * z - sp * x
            x, y = cy * x - sy * y, sy * x + cy * y
            x, z = cp0 * x - sp0 * z, sp0 * x + cp0 * z
            y, z = cr0 * y + sr0 * z, cr0 * z - sr0 * y
            arms[k, rail, 0], arms[k, rail, 1], arms[k, rail, 2] = x, y, z
            rails[k, rail, 0] = y + states[k, 3] - (half_base if rail == 0 else -half_base)
            rails[k, rail, 1] = z + states[k, 4]


@njit_borrowed
def variances(arms: FloatArray, covariance: FloatArray, found: FloatArray) -> None:
    """Variance of the irregularities, of the first four columns of ``found``.

    Parameters
    ----------
    arms : ndarray (n, 2, 3)
        As in `rails_seen`.
    covariance : ndarray (n, 3, 3)
        Of roll, lateral and vertical position.
    found : ndarray (n, >= 4), out
        In the order of `simrail.core.columns.IRREGULARITY`, m2.
    """
    for k in range(arms.shape[0]):
        left_y, left_z, right_y, right_z = arms[k, 0, 1], arms[k, 0, 2], arms[k, 1, 1], arms[k, 1, 2]
        # A turn by d about X moves a rail by d (-arm_z, arm_y).
        alignment, profile = -0.5 * (left_z + right_z), 0.5 * (left_y + right_y)
        roll = covariance[k, 0, 0]
        found[k, 0] = alignment * (alignment * roll + 2.0 * covariance[k, 0, 1]) + covariance[k, 1, 1]
        found[k, 1] = profile * (profile * roll + 2.0 * covariance[k, 0, 2]) + covariance[k, 2, 2]
        found[k, 2] = (left_y - right_y) ** 2 * roll
        found[k, 3] = (left_z - right_z) ** 2 * roll


@njit_borrowed
def means_of_cells(kinds: IntArray, values: FloatArray, count: IntArray, means: FloatArray) -> None:
    """Mean of values (n, m) of each kind (n,), into means (c, m), which are zero before; count is (c,)."""
    for k in range(values.shape[0]):
        for i in range(values.shape[1]):
            means[kinds[k], i] += values[k, i]
    for kind in range(means.shape[0]):
        for i in range(means.shape[1]):
            means[kind, i] /= count[kind]


@njit_borrowed
def spline_slopes(at: FloatArray, values: FloatArray, work: FloatArray, slopes: FloatArray) -> None:
    """Slopes at its knots of the cubic spline through values (c, m) at c >= 4 increasing places.

    Its second derivative is continuous, and its third at the second knot and the last but one ("not a knot");
    the equations are those of C. de Boor, A Practical Guide to Splines, Springer 1978, chapter IV, solved by
    elimination without pivots.

    Parameters
    ----------
    at : ndarray (c,)
    values : ndarray (c, m)
    work : ndarray (c,)
    slopes : ndarray (c, m), out
    """
    last, columns = at.shape[0] - 1, values.shape[1]
    before, after = at[1] - at[0], at[2] - at[1]
    both = before + after
    work[0] = both / after
    for i in range(columns):
        rise, next_rise = (values[1, i] - values[0, i]) / before, (values[2, i] - values[1, i]) / after
        right = ((before + 2.0 * both) * after * rise + before * before * next_rise) / both
        slopes[0, i] = right / after
    for k in range(1, last):
        before, after = at[k] - at[k - 1], at[k + 1] - at[k]
        inverse = 1.0 / (2.0 * (before + after) - after * work[k - 1])
        work[k] = before * inverse
        below, above = 3.0 * after / before, 3.0 * before / after
        for i in range(columns):
            right = below * (values[k, i] - values[k - 1, i]) + above * (values[k + 1, i] - values[k, i])
            slopes[k, i] = (right - after * slopes[k - 1, i]) * inverse
    before, after = at[last - 1] - at[last - 2], at[last] - at[last - 1]
    both = before + after
    inverse = 1.0 / (before - both * work[last - 1])
    for i in range(columns):
        rise = (values[last - 1, i] - values[last - 2, i]) / before
        last_rise = (values[last, i] - values[last - 1, i]) / after
        right = (after * after * rise + (2.0 * both + after) * before * last_rise) / both
        slopes[last, i] = (right - both * slopes[last - 1, i]) * inverse
    for k in range(last - 1, -1, -1):
        for i in range(columns):
            slopes[k, i] -= work[k] * slopes[k + 1, i]


@njit_borrowed
def on_spline(
    at: FloatArray, values: FloatArray, slopes: FloatArray, places: FloatArray, found: FloatArray
) -> None:
    """The spline of `spline_slopes` at places (n,) that do not decrease, (n, m), out; beyond it its ends."""
    k, last = 0, at.shape[0] - 1
    for j in range(places.shape[0]):
        place = min(max(places[j], at[0]), at[last])
        while k < last - 1 and place >= at[k + 1]:
            k += 1
        length = at[k + 1] - at[k]
        share, inverse = place - at[k], 1.0 / length
        for i in range(values.shape[1]):
            rise = (values[k + 1, i] - values[k, i]) * inverse
            bend = (slopes[k, i] + slopes[k + 1, i] - 2.0 * rise) * inverse
            second = (rise - slopes[k, i]) * inverse - bend
            found[j, i] = values[k, i] + share * (slopes[k, i] + share * (second + share * bend * inverse))


@njit_borrowed
def thinned(line: FloatArray, taps: FloatArray, every: int, is_odd: bool, found: FloatArray) -> None:
    """Low-pass a line and keep every so many samples of it.

    Parameters
    ----------
    line : ndarray (n, 4 m)
    taps : ndarray (2 r + 1,)
        Symmetric.
    every : int
    is_odd : bool
        Beyond its ends the line is turned about its end points, else mirrored; again if it is short.
    found : ndarray ((n - 1) // every + 1, 4 m), out
    """
    last, reach = line.shape[0] - 1, taps.shape[0] // 2
    for first in range(0, line.shape[1], 4):
        for j in range(found.shape[0]):
            begin = j * every - reach
            if begin >= 0 and begin + 2 * reach <= last:
                _within(line, taps, begin, first, j, found)
            else:
                _beyond(line, taps, begin, first, is_odd, j, found)


@njit_inline
def _within(line: FloatArray, taps: FloatArray, begin: int, first: int, j: int, found: FloatArray) -> None:
    """Row j of what is found, from within the line; taps of both sides at once, since they are the same."""
    reach, end = taps.shape[0] // 2, begin + taps.shape[0] - 1
    centre, share = begin + reach, taps[reach]
    a, b, c, d = (
        share * line[centre, first],
        share * line[centre, first + 1],
        share * line[centre, first + 2],
        share * line[centre, first + 3],
    )
    e = f = g = h = 0.0
    for t in range(0, reach - 1, 2):
        share, low, high = taps[t], begin + t, end - t
        a += share * (line[low, first] + line[high, first])
        b += share * (line[low, first + 1] + line[high, first + 1])
        c += share * (line[low, first + 2] + line[high, first + 2])
        d += share * (line[low, first + 3] + line[high, first + 3])
        share, low, high = taps[t + 1], begin + t + 1, end - t - 1
        e += share * (line[low, first] + line[high, first])
        f += share * (line[low, first + 1] + line[high, first + 1])
        g += share * (line[low, first + 2] + line[high, first + 2])
        h += share * (line[low, first + 3] + line[high, first + 3])
    found[j, first], found[j, first + 1], found[j, first + 2], found[j, first + 3] = (
        a + e,
        b + f,
        c + g,
        d + h,
    )


@njit_inline
def _beyond(
    line: FloatArray, taps: FloatArray, begin: int, first: int, is_odd: bool, j: int, found: FloatArray
) -> None:
    """Row j of what is found, where the low-pass sees beyond an end of the line."""
    last = line.shape[0] - 1
    a = b = c = d = 0.0  # four at once: the compiler takes them for one vector
    for t in range(taps.shape[0]):
        at, share = begin + t, taps[t]
        while not 0 <= at <= last:
            end = 0 if at < 0 else last
            at = 2 * end - at
            if is_odd:
                twice, share = 2.0 * share, -share
                a, b = a + twice * line[end, first], b + twice * line[end, first + 1]
                c, d = c + twice * line[end, first + 2], d + twice * line[end, first + 3]
        a, b = a + share * line[at, first], b + share * line[at, first + 1]
        c, d = c + share * line[at, first + 2], d + share * line[at, first + 3]
    found[j, first], found[j, first + 1], found[j, first + 2], found[j, first + 3] = a, b, c, d
