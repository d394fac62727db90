"""Elementary functions for kernels: the same bits on every machine, in machine code and in plain Python.

Those of the mathematics library differ between its versions. These compute with a head of few bits, whose products
are exact, and a tail, and round once at the end. So nearly all results are the float64 nearest to the exact value.
Nothing is fused, and tables are made of whole numbers when they are imported.

Notes
-----
*Source:* P. T. P. Tang, "Table-driven implementation of the exponential function in IEEE floating-point arithmetic"
(ACM TOMS 15, 1989) and "Table-driven implementation of the logarithm function …" (ACM TOMS 16, 1990) for the
reductions; T. J. Dekker, "A floating-point technique for extending the available precision" (Numerische Mathematik 18,
1971) for heads and tails. *Departs:* the heads of a table's entries have few bits, so that their products are exact.
"""

from __future__ import annotations

import math
from math import isqrt

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import bits_of, float_of, inlined, kernel

# Numbers in the making of tables are whole multiples of 2^−160.
_BITS = 160
_ONE = 1 << _BITS


def _series(z: int, sign: int) -> int:
    """Return z + sign·z³/3 + z⁵/5 + …, for z > 0: the inverse tangent (sign −1) or that of the hyperbolic one (1)."""
    total, power, square, k = 0, z, sign * z * z >> _BITS, 1
    while power:
        total += power // k
        power = power * square >> _BITS
        k += 2
    return total


def _parts(value: int, bits: int = 0) -> tuple[float, float]:
    """Return a number as head and tail; the head is the nearest float64, or the nearest multiple of 2^−bits."""
    unit = _ONE >> bits
    head = (value + unit // 2) // unit / (1 << bits) if bits else value / _ONE
    return head, (value - int(head * 2.0**_BITS)) / _ONE


_LN2 = 2 * _series(_ONE // 3, 1)
_LN2_HEAD, _LN2_TAIL = _parts(_LN2, 42)

# 2^(j/128). Heads have 26 bits behind the point.
_STEPS = 128
_PER_STEP = _STEPS * _ONE / _LN2
_STEP, _STEP_TAIL = _parts(_LN2 // _STEPS, 42)


def _powers() -> npt.NDArray[np.float64]:
    root = 2 * _ONE
    for _ in range(7):
        root = isqrt(root << _BITS)
    powers = [_ONE]
    while len(powers) < _STEPS:
        powers.append(powers[-1] * root >> _BITS)
    return np.array([_parts(one, 26) for one in powers])


_POWERS = _powers()

# For each multiple i/128 between √½ and √2: 128/i rounded to 12 bits behind the point, and minus its logarithm.
_FIRST, _LAST = 90, 181
# The bits of √2 behind the point.
_ROOT = np.uint64(isqrt(2 << 104) - (1 << 52))


def _logarithms() -> npt.NDArray[np.float64]:
    factors = [(4096 * 128 + i // 2) // i for i in range(_FIRST, _LAST + 1)]
    found = {4096: 0}
    # Each from its neighbour nearer to 1, by a short series.
    for away in (reversed(factors[: 128 - _FIRST]), factors[129 - _FIRST :]):
        before = 4096
        for factor in away:
            step = 2 * _series(_ONE * abs(before - factor) // (before + factor), 1)
            found[factor] = found[before] + (step if factor < before else -step)
            before = factor
    return np.array([(factor / 4096, *_parts(found[factor], 42)) for factor in factors])


_LOGARITHMS = _logarithms()


def _angles() -> npt.NDArray[np.float64]:
    """Return a + s·atan(i/64) for i = 0 to 64, for (a, s) = (0, 1), (π, −1), (π/2, −1) and (π/2, 1)."""
    angles = [0]
    for i in range(64):
        angles.append(angles[-1] + _series(64 * _ONE // (4096 + i * (i + 1)), -1))
    right = 2 * angles[-1]
    quarters = ((0, 1), (2 * right, -1), (right, -1), (right, 1))
    return np.array([_parts(a + s * angle) for a, s in quarters for angle in angles])


_ANGLES = _angles()

_LEAST_NORMAL = 2.0**-1022
_FIRST_BITS = np.uint64(2**64 - 2**27)

# A quarter of a turn: two parts of 33 bits, and the rest. Taylor's series, whose next terms are below 1e-18.
_PI = 16 * _series(_ONE // 5, -1) - 4 * _series(_ONE // 239, -1)
_PART = _parts(_PI // 2, 33)[0]
_QUARTER = (_PART, *_parts(_PI // 2 - int(_PART * 2.0**_BITS), 66))
_SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(8, 0, -1))
_COSINE = tuple((-1) ** k / math.factorial(2 * k) for k in range(8, 0, -1))


@inlined
def _power_of_2(exponent: int) -> float:
    return float(float_of(np.uint64(exponent + 1023) << np.uint64(52)))


@inlined
def _head(number: float) -> float:
    """Return the first 26 bits of a number."""
    return float(float_of(bits_of(number) & _FIRST_BITS))


@kernel
def _exp(x: float, tail: float) -> float:
    """Return e to the power of x + tail, where `tail` is about an ulp of x or less."""
    if not abs(x) < 746.0:
        return x if x != x else (math.inf if x > 0.0 else 0.0)
    # x + tail = (128·k + j) · ln 2 / 128 + r, and |r| < 2^−8.5. To add and subtract 1.5 · 2^n rounds to 2^(n − 52).
    steps = (x * _PER_STEP + 1.5 * 2.0**52) - 1.5 * 2.0**52
    rest = x - steps * _STEP
    head = (rest + 1.5 * 2.0**18) - 1.5 * 2.0**18
    rest = (rest - head) + (tail - steps * _STEP_TAIL)
    r = head + rest
    # Grouped so that parts are computed at the same time, here and below.
    rr = r * r
    rest += rr * ((1 / 2 + r * (1 / 6)) + rr * ((1 / 24 + r * (1 / 120)) + rr * (1 / 720)))
    number = int(steps)
    j = np.uint64(number & (_STEPS - 1))
    k = number >> 7
    power = float(_POWERS[j, 0])
    product = power * head
    most = power + product
    least = (product - (most - power)) + (float(_POWERS[j, 1]) * (1.0 + (head + rest)) + power * rest)
    if abs(x) < 708.0:
        return (most + least) * _power_of_2(k)
    # By two factors, since one may be too large or too small.
    half = k >> 1
    result = (most + least) * _power_of_2(half) * _power_of_2(k - half)
    if result >= _LEAST_NORMAL:
        return result
    # Rounded once, to the last bit that the result will have.
    unit = _power_of_2(-1022 - k)
    rounded = unit + most
    rounded += (most - (rounded - unit)) + least
    return (rounded - unit) * _power_of_2(half) * _power_of_2(k - half)


@kernel
def _log(x: float) -> tuple[float, float]:
    """Return the natural logarithm of a number as the nearest float64 and the rest."""
    shift = 0.0
    if not _LEAST_NORMAL <= x < math.inf:
        if not 0.0 < x < math.inf:
            return (-math.inf if x == 0.0 else (math.nan if x < 0.0 else x)), 0.0
        x *= 2.0**54
        shift = 54.0
    bits = bits_of(x)
    # Numbers, not branches: half of them would be mispredicted.
    fraction = bits & np.uint64(2**52 - 1)
    is_high = np.int64(fraction > _ROOT)
    m = float(float_of(fraction | np.uint64(1023 - is_high) << np.uint64(52)))
    k = float(np.int64(bits >> np.uint64(52)) - 1023 + is_high) - shift
    # m · factor = 1 + r, and |r| < 2^−7.4.
    i = np.uint64(int(m * 128.0 + 0.5) - _FIRST)
    factor = float(_LOGARITHMS[i, 0])
    head = _head(m)
    product = head * factor - 1.0
    rest = (m - head) * factor
    r = product + rest
    head = _head(r)
    rest += product - head
    base = k * _LN2_HEAD + float(_LOGARITHMS[i, 1])
    sum_1 = base + head
    error_1 = head - (sum_1 - base)
    square = 0.5 * head * head
    sum_2 = sum_1 - square
    error_2 = (sum_1 - sum_2) - square
    rr = r * r
    series = (1 / 3 - r * (1 / 4)) + rr * (1 / 5 - r * (1 / 6))
    series = r * rr * (series + rr * rr * ((1 / 7 - r * (1 / 8)) + rr * (1 / 9)))
    least = (k * _LN2_TAIL + float(_LOGARITHMS[i, 2])) + (rest - 0.5 * rest * (head + r))
    least = (error_1 + error_2) + (least + series)
    result = sum_2 + least
    return result, least - (result - sum_2)


@kernel
def exp(x: float) -> float:
    """Return e to the power of x; the error is below 0.5001 ulp (units in the last place), also of subnormal results.

    Parameters
    ----------
    x : float
        Any number; inf is returned from 709.79 on, 0 below −745.14, and NaN for NaN.
    """
    return _exp(x, 0.0)


@kernel
def log(x: float) -> float:
    """Return the natural logarithm of x; the error is below 0.5001 ulp.

    Parameters
    ----------
    x : float
        Any number; −inf is returned for 0, and NaN below.
    """
    return _log(x)[0]


@kernel
def power(base: float, exponent: float) -> float:
    """Return a number to the power of another; the error is below 0.51 ulp.

    Parameters
    ----------
    base : float
        At least 0; NaN is returned below.
    exponent : float
        Any number; the power of 0 is 1, and that of 1 is the base, whatever that is.
    """
    if exponent == 1.0:
        return base
    if exponent == 0.0 or base == 1.0:
        return 1.0
    logarithm, rest = _log(base)
    product = exponent * logarithm
    if abs(product) < 746.0:
        head, part = _head(exponent), _head(logarithm)
        error = (head * part - product) + head * (logarithm - part)
        rest = exponent * rest + ((error + (exponent - head) * part) + (exponent - head) * (logarithm - part))
    return _exp(product, rest)


@kernel
def atan2(y: float, x: float) -> float:
    """Return the angle of (x, y) from the x axis, anticlockwise from −π to π; the error is below 0.5001 ulp.

    From Python ``plain(atan2)`` is called, which needs no compiler.

    Parameters
    ----------
    y, x : float
        Any numbers; those that are 0 or infinite have the angles of IEEE 754, and (0, 0) has 0, of the sign of y.
    """
    if x != x or y != y:
        return x + y
    wide, high = abs(x), abs(y)
    is_steep = high > wide
    far, near = (high, wide) if is_steep else (wide, high)
    is_behind = math.copysign(1.0, x) < 0.0
    if far == 0.0:
        return math.copysign(math.pi if is_behind else 0.0, y)
    if near == math.inf:
        near = far = 1.0
    u = least = 0.0
    i = 0
    if near < far * 2.0**-60:
        # Its angle is the quotient, once rounded.
        u = near / far
    else:
        # Powers of 2 that keep all products in range.
        if far > 2.0**900:
            near, far = near * 2.0**-600, far * 2.0**-600
        elif far < 2.0**-900:
            near, far = near * 2.0**600, far * 2.0**600
        # The tangent as t + rest, where t has 20 bits.
        inverse = 1.0 / far
        t = near * inverse
        product = (2.0**33 + 1.0) * t
        t = product - (product - t)
        product = (2.0**27 + 1.0) * far
        head = product - (product - far)
        rest = ((near - t * head) - t * (far - head)) * inverse
        # That of its angle minus atan(i/64), as u + least: (t + rest − c) / (1 + c·(t + rest)), where u has 19 bits.
        i = int(64.0 * t + 0.5)
        c = i * (1 / 64)
        numerator, denominator = t - c, 1.0 + c * t
        inverse = 1.0 / (denominator + c * rest)
        u = numerator * inverse
        product = (2.0**34 + 1.0) * u
        u = product - (product - u)
        least = ((numerator - u * denominator) + rest * (1.0 - c * u)) * inverse
        whole = u + least
        s = whole * whole
        least -= whole * s * ((1 / 3 - s * (1 / 5)) + s * s * (1 / 7 - s * (1 / 9)))
    if is_steep != is_behind:
        u, least = -u, -least
    row = np.uint64(i + 65 * (2 * is_steep + is_behind))
    most = float(_ANGLES[row, 0])
    total = most + u
    return math.copysign(total + ((u - (total - most)) + (float(_ANGLES[row, 1]) + least)), y)


@kernel
def cos_sin(angle: float) -> tuple[float, float]:
    """Return the cosine and the sine of an angle, with an error below 2⁻⁵²; NaN from a million on.

    From Python ``plain(cos_sin)`` is called, which needs no compiler.

    Parameters
    ----------
    angle : float
        Any number [rad].
    """
    if not abs(angle) < 1e6:
        return math.nan, math.nan
    if angle == 0.0:
        return 1.0, angle
    # Quarters of a turn are subtracted in three parts; the products of the first two are exact.
    quarters = np.rint(angle * (2.0 / math.pi))
    rest = ((angle - quarters * _QUARTER[0]) - quarters * _QUARTER[1]) - quarters * _QUARTER[2]
    square = rest * rest
    sine, cosine = 0.0, 0.0
    for term in _SINE:
        sine = (sine + term) * square
    for term in _COSINE:
        cosine = (cosine + term) * square
    sine, cosine = rest + rest * sine, 1.0 + cosine
    turns = int(quarters) % 4
    if turns % 2:
        cosine, sine = -sine, cosine
    return (-cosine, -sine) if turns >= 2 else (cosine, sine)


@kernel
def modulo(number: float, period: float) -> float:
    """Return ``number % period`` for a period above 0, exactly, or rounded once for numbers below 0."""
    rest = abs(number)
    if not rest < math.inf:
        return math.nan
    step = period
    while rest - step >= step:
        step *= 2.0
    # No difference is rounded.
    while step >= period:
        rest = rest - step if rest >= step else rest
        step *= 0.5
    return period - rest if number < 0.0 and rest > 0.0 else rest
