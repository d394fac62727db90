"""Slow twins of the elementary functions: textbook series in decimal numbers of 80 digits."""

from __future__ import annotations

from decimal import Context, Decimal, localcontext

PRECISION = Context(prec=80, Emax=10**9, Emin=-(10**9))


def exp(x: float) -> Decimal:
    return Decimal(x).exp(PRECISION)


def log(x: float) -> Decimal:
    return Decimal(x).ln(PRECISION)


def power(base: float, exponent: float) -> Decimal:
    return PRECISION.exp(PRECISION.multiply(Decimal(base).ln(PRECISION), Decimal(exponent)))


def atan2(y: float, x: float) -> Decimal:
    """The angle of (x, y), which is not (0, 0)."""
    with localcontext(PRECISION):
        # Both rounded to this precision, so that equal numbers stay equal.
        ahead, left = +Decimal(x), abs(Decimal(y))
        if ahead >= left:
            angle = _atan(left / ahead)
        elif left > abs(ahead):
            angle = 2 * _atan(Decimal(1)) - _atan(ahead / left)
        else:
            angle = 4 * _atan(Decimal(1)) + _atan(left / ahead)
        return angle.copy_sign(Decimal(y))


def _atan(t: Decimal) -> Decimal:
    """The inverse tangent of a number from −1 to 1: 64 times that of a smaller one, by its series."""
    for _ in range(6):
        t /= 1 + (1 + t * t).sqrt()
    total, power, k = Decimal(0), t, 1
    while abs(power) > abs(t) * Decimal(10) ** -PRECISION.prec:
        total += power / k
        power *= -t * t
        k += 2
    return 64 * total


def cos(x: float) -> Decimal:
    return _alternating(x, 0)


def sin(x: float) -> Decimal:
    return _alternating(x, 1)


def _alternating(x: float, first: int) -> Decimal:
    """x^k / k! with alternating signs, over every second k from the first."""
    with localcontext(PRECISION):
        angle = Decimal(x)
        total, term, k = Decimal(0), angle if first else Decimal(1), first
        while abs(term) > Decimal(10) ** -40 or k < abs(angle):
            total += term
            term *= -angle * angle / ((k + 1) * (k + 2))
            k += 2
        return total
