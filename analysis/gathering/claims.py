"""G1 to G4: what the gathering index says of the paper's method, as claims that can fail."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

from scipy.stats import binom

from teamsight.analysis.gathering.cells import CONFIDENCE, Cell, DeltaInterval

Outcome = Literal["holds", "does not hold", "undecided"]
# Teams of at most so many robots are those of the classics; from so many on the method has something to decide.
_SMALL, _LARGE = 5, 8
# The probability with which the bounds of a cell fail, and with which a verdict for all cells may.
_ERROR = 1 - CONFIDENCE


class Claim(NamedTuple):
    """A claim.

    Attributes
    ----------
    name : str
        Its name.
    statement : str
        What it says of one task and team size.
    rule : str
        When it holds, and when it does not.
    applies : callable
        Whether it is about a cell.
    judge : callable
        Its verdict on a cell.
    """

    name: str
    statement: str
    rule: str
    applies: Callable[[Cell], bool]
    judge: Callable[[Cell], Outcome]


class Verdict(NamedTuple):
    """A claim judged for one task and team size, or for all (an empty task, size 0)."""

    claim: str
    task: str
    size: int
    outcome: Outcome
    measured: str


def _order(smaller: DeltaInterval, larger: DeltaInterval, *, strictly: bool) -> Outcome:
    """Judge whether one δ is smaller than another, or not larger, by bounds that hold together."""
    if smaller.high < larger.low or (not strictly and smaller.high <= larger.low):
        return "holds"
    if smaller.low > larger.high or (strictly and smaller.low >= larger.high):
        return "does not hold"
    return "undecided"


def _enough(cell: Cell) -> Outcome:
    """Judge whether the objective is within the tolerance from δ(skilled) on."""
    if cell.saturation.high <= cell.skilled.delta:
        return "holds"
    return "does not hold" if cell.saturation.low > cell.skilled.delta else "undecided"


def _near_all(cell: Cell) -> Outcome:
    """Judge whether exploration shows N − 1 neighbours, or one less."""
    if cell.explore.low >= cell.size - 2:
        return "holds"
    return "does not hold" if cell.explore.high < cell.size - 2 else "undecided"


def _can_say(cell: Cell) -> bool:
    """Return whether the order of both δ is open, and that of a team with skill."""
    return cell.explore.low < cell.size - 1 and cell.has_skill != "no"


_OPPOSITE: dict[Outcome, Outcome] = {"holds": "does not hold", "does not hold": "holds", "undecided": "undecided"}

#: The claims that are judged for each cell, by name.
CLAIMS: dict[str, Claim] = {
    claim.name: claim
    for claim in (
        Claim(
            "G1", "Where success disperses the team, exploration shows at least as many neighbours as skill.",
            "holds if δ(explore) ≥ δ(skilled) for all values within the bounds, does not hold if for none; where "
            "exploration shows all N − 1 it would hold whatever happens, and where the team with skill is not better "
            "than the one that explores it says nothing: not judged",
            lambda cell: cell.gathers is False and _can_say(cell),
            lambda cell: _order(cell.skilled, cell.explore, strictly=False),
        ),
        Claim(
            "G2", "Where success gathers the team, exploration shows fewer neighbours than skill.",
            "holds if δ(explore) < δ(skilled) for all values within the bounds, does not hold if for none; where "
            "exploration shows all N − 1 it would not hold whatever happens, and where the team with skill is not "
            "better than the one that explores it says nothing: not judged",
            lambda cell: cell.gathers is True and _can_say(cell),
            lambda cell: _order(cell.explore, cell.skilled, strictly=True),
        ),
        Claim(
            "G3", "The objective saturates at or before δ(skilled).",
            "holds if the objective is within the tolerance at δ(skilled) and beyond, by bounds; does not hold if it "
            "is shown to be outside there; where δ(skilled) is N − 1 it would hold whatever happens: not judged",
            lambda cell: cell.skilled.delta < cell.size - 1, _enough,
        ),
        Claim(
            "G4 small", "For teams of 2 to 5, δ is N − 1, within one, by exploration: there is nothing to decide.",
            "holds if δ(explore) ≥ N − 2 for all values within the bounds, does not hold if for none",
            lambda cell: cell.size <= _SMALL, _near_all,
        ),
        Claim(
            "G4 large", "From N = 8 on, exploration shows fewer than N − 2 neighbours: there is something to decide.",
            "holds if δ(explore) < N − 2 for all values within the bounds, does not hold if for none",
            lambda cell: cell.size >= _LARGE, lambda cell: _OPPOSITE[_near_all(cell)],
        ),
    )
}  # fmt: skip
#: The claim about all cells together.
UNRELIABLE = "G3 explore"
UNRELIABLE_STATEMENT = (
    "The objective does not reliably saturate at δ(explore): in some cell it is shown to be outside the tolerance."
)


def judge(cells: Sequence[Cell]) -> list[Verdict]:
    """Return the verdict on each claim for each cell that it is about, and that on δ(explore) for all cells."""
    found = [
        Verdict(claim.name, cell.task, cell.size, claim.judge(cell), _measured(cell))
        for claim in CLAIMS.values()
        for cell in cells
        if claim.applies(cell)
    ]
    overall = [_overall(name, found) for name in CLAIMS if any(one.claim == name for one in found)]
    return [*found, *overall, _unreliable(cells)]


def by_chance(cells: int) -> int:
    """Return of how many cells so many may speak against a true claim by chance, with a probability above 5 %.

    Notes
    -----
    Each cell does so with at most 5 %, and cells have different seeds: a binomial distribution.
    """
    return next(most for most in range(cells + 1) if binom.sf(most, cells, _ERROR) <= _ERROR)


def _overall(claim: str, found: Sequence[Verdict]) -> Verdict:
    """Judge a claim for all cells: it holds if it does in each, and fails if more are against it than by chance."""
    outcomes = [one.outcome for one in found if one.claim == claim]
    counts = {outcome: outcomes.count(outcome) for outcome in _OPPOSITE}
    against = counts["does not hold"]
    most = by_chance(len(outcomes))
    outcome: Outcome = "undecided"
    if counts["holds"] == len(outcomes):
        outcome = "holds"
    elif against > most:
        outcome = "does not hold"
    shares = ", ".join(f"{number} {name}" for name, number in counts.items())
    return Verdict(claim, "", 0, outcome, f"{shares}; up to {most} against by chance")


def _unreliable(cells: Sequence[Cell]) -> Verdict:
    # With all N − 1 teammates nothing can be missing.
    cells = [cell for cell in cells if cell.explore.delta < cell.size - 1]
    answers = [cell.is_enough(cell.explore.delta) for cell in cells]
    outcome: Outcome = "undecided"
    # One of many cells would be outside by chance: here bounds hold together for all.
    if any(cell.is_shown_short for cell in cells):
        outcome = "holds"
    elif answers and set(answers) == {"yes"}:
        outcome = "does not hold"
    counts = ", ".join(f"{answers.count(answer)} {answer}" for answer in ("yes", "no", "undecided"))  # type: ignore[arg-type]
    return Verdict(UNRELIABLE, "", 0, outcome, f"enough at δ(explore): {counts}")


def _measured(cell: Cell) -> str:
    named = {"explore": cell.explore, "skilled": cell.skilled, "saturates": cell.saturation}
    return ", ".join(f"{name} {shown(value)}" for name, value in named.items())


def shown(value: DeltaInterval) -> str:
    """Return δ and its bounds."""
    return f"{value.delta} ({value.low} to {value.high})"
