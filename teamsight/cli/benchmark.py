"""``teamsight benchmark``: how does a policy stand beside others, in fixed worlds?"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.agents.awareness.registry import AWARENESS
from teamsight.cli.options import File, Folder, Works, Writes, component_options, made_of, options_in
from teamsight.core import checks
from teamsight.core.component import Allowed, Declared, Flag, declared, of_name, with_tables
from teamsight.policies.registry import POLICIES

if TYPE_CHECKING:
    from teamsight.analysis.benchmark import Entrant, Results
    from teamsight.analysis.stats.paired import Interval


@dataclass(frozen=True, kw_only=True)
class BenchmarkSettings(Works, Writes):
    """Options of ``teamsight benchmark``.

    Parameters
    ----------
    policy : str, optional
        Policy to enter: a name, "module:Class" or "file.py:Class".
    awareness : str, optional
        Its degree of awareness.
    name : str, optional
        What the tables call it.
    quick : bool
        Make a fifth of the runs.
    reference : Path, optional
        Results beside which it stands, a benchmark.json.
    out : Path, optional
        Folder for the results with this team, their page and its figure; teams that it has already stay.
    make : tuple of str
        A team that ships and is run again; "missing" for those that the results lack, "all" for all. For maintainers.
    """

    policy: Annotated[str | None, Allowed(choices=POLICIES, shown="none: show the results")] = None  # type: ignore[assignment]
    awareness: Annotated[str | None, Allowed(choices=AWARENESS, shown="pairwise, or the first that fits")] = None
    name: Annotated[str | None, Allowed(shown="that of the policy")] = None
    quick: Flag = False
    reference: Annotated[File | None, Allowed(shown="those that ship")] = None
    out: Annotated[Folder | None, Allowed(shown="none")] = None
    make: Annotated[tuple[str, ...], Allowed(is_repeated=True, metavar="TEAM")] = ()

    @classmethod
    def brings(cls, arguments: Sequence[str]) -> Mapping[str, Declared]:
        """Return the options of the policy and of the degree that are named."""
        named = {name: one for name, one in cls.options().items() if options_in(arguments, name)}
        return component_options({name: named[name] for name in ("policy", "awareness") if name in named}, arguments)

    def check(self) -> None:
        """Refuse options that do not go together."""
        if self.policy is None:
            self.refuse(("awareness", "name", "quick"), "is of a policy; give --policy")
        if self.quick:
            self.refuse(("out",), "results of a quick look are not kept")
        if self.make and self.out is None:
            raise ValueError(f"make={','.join(self.make)}: its results would be lost; give --out")

    def own(self, name: str) -> dict[str, Any]:
        """Return the options of the policy, or of the degree, with what they name made."""
        if (chosen := getattr(self, name)) is None:
            return {}
        known = declared(of_name(declared(type(self))[name], chosen))
        own = {one.removeprefix(f"{name}."): value for one, value in self.brought.items() if one.startswith(f"{name}.")}
        return {option: made_of(known[option], value) for option, value in with_tables(own, f"{name}.").items()}


def benchmark(settings: BenchmarkSettings) -> int | None:
    """Enter a policy in the benchmark of CMOMMT, or show its results.

    Teams run in 22 scenarios, on fixed seeds. Those that ship are not run again: their results come with the package,
    and a policy is compared with them in pairs, since all meet the same worlds. A policy with a kernel takes less than
    a minute; one in Python takes longer, and --quick makes a fifth of the runs.

    \b
    Examples:
      teamsight benchmark
      teamsight benchmark --policy evolved --awareness nearest
      teamsight benchmark --policy examples/enter.py:Chase --awareness none
      teamsight benchmark --policy my_package:Mine --name mine --out results
    """
    from teamsight.analysis import benchmark as bench
    from teamsight.analysis.runs.files import check_results, prepare_folder, write_results
    from teamsight.cli.show import kept_in, say, working

    is_new = "all" in settings.make
    kept = settings.out and settings.out / bench.FILES[0]
    is_kept = kept is not None and kept.exists() and not settings.force
    results = (
        bench.Results() if is_new else bench.Results.read(settings.reference or (kept if is_kept else bench.REFERENCE))  # type: ignore[arg-type]
    )
    entrants: dict[str, Entrant] = bench.outdated(results) if is_new or "missing" in settings.make else {}
    for team in settings.make:
        if team not in ("all", "missing"):
            checks.choice("make", team, bench.ENTRANTS)
            entrants[team] = bench.ENTRANTS[team]
    name = None
    if settings.policy is not None:
        name = _name(settings, results)
        entrants[name] = _entrant(settings)
    folder = settings.out and prepare_folder(settings.out)
    checkpoint = None
    if folder:
        checkpoint = bench.checkpoint(folder)
        check_results(folder, bench.FILES, checkpoint=checkpoint, force=settings.force)
    if entrants:
        runs = bench.QUICK if settings.quick else bench.RUNS
        is_long = settings.make or not bench.is_compiled(entrants[str(name)])
        if is_long and not settings.make and not settings.quick:
            say("the policy decides in Python, which takes minutes; --quick makes a fifth of the runs")
        work = math.inf if is_long else bench.agent_steps(runs)
        left = (lambda: kept_in(checkpoint.path, checkpoint.count())) if checkpoint else (lambda: "nothing was kept")
        with working(settings, left, agent_steps=work) as (watch, pool):
            found = bench.run(entrants, runs, pool=pool, checkpoint=checkpoint, progress=partial(watch, "running"))
        results = results.joined(found)
    _show(results, name)
    if folder:
        (folder / "images").mkdir(exist_ok=True)
        write_results(folder, bench.contents(results), {}, force=settings.force)
        if checkpoint:
            checkpoint.forget()
        say(f"results, page and figure in {folder}")
    return None


def _name(settings: BenchmarkSettings, results: Results) -> str:
    """Return what the tables call the policy."""
    from teamsight.analysis.benchmark import BOUND, ENTRANTS

    ships = {*ENTRANTS, BOUND}
    if settings.name is not None:
        if settings.name in ships | results.teams.keys():
            raise ValueError(f"name={checks.shown(settings.name)}: is a team of the results; give another name")
        if not settings.name.isprintable() or not settings.name.strip() or set(settings.name) & {"`", "|"}:
            raise ValueError(
                f"name={checks.shown(settings.name)}: must be one line of text, without ` and |; it stands in tables"
            )
        return settings.name
    text = str(settings.policy)
    return f"{text}, yours" if text in ships else text


def _entrant(settings: BenchmarkSettings) -> Entrant:
    """Return the team that is entered."""
    from teamsight.agents.resolve import policy_of
    from teamsight.analysis.benchmark import Entrant
    from teamsight.analysis.ceilings import fitting

    options = settings.own("policy")
    degree: Any = settings.awareness and AWARENESS[settings.awareness](**settings.own("awareness"))
    if degree is None:
        degree = fitting(policy_of(settings.policy, options))
    return Entrant(settings.policy, degree, options, transitions=None)


def _show(results: Results, name: str | None) -> None:
    """Print how all teams stand, and in which scenarios the one of this name observes how much."""
    from teamsight.analysis import benchmark as bench
    from teamsight.analysis.ceilings import CEILING
    from teamsight.cli.show import interval, say, show_table

    def written(one: Interval | None, how: str = ".1f") -> str:
        return "" if one is None or math.isnan(one.mean) else interval(one._asdict(), how)

    rows = []
    standings = results.standings(name)
    for one in standings:
        team = results.teams[one.team]
        cpu, inputs, transitions = team["cpu_us_per_decision"], team["inputs"], team["transitions"]
        rows.append((
            one.rank or "", one.team, team["order"] or "", inputs["10"] if inputs else "",
            "" if transitions is None else f"{transitions:.3g}", written(one.score),
            *((written(one.less, "+.1f"),) if name else ()), (way := bench.way_text(one.way)) and f"{way} %",
            "" if cpu is None else f"{cpu:.3g}",
        ))  # fmt: skip
        if one.team == name:
            rank = f"rank {one.rank} of {sum(bool(other.rank) for other in standings)}: " if one.rank else ""
            say(f"{rank}{name} observes {written(one.score)} % of the targets")
    titles = (
        "", "team", "awareness", "inputs", "transitions", "observed [%]", *((f"{name} less it",) if name else ()),
        "of the way", "µs a step",
    )  # fmt: skip
    # A narrow terminal shows how they stand, a wider one also what they need for it.
    needs = tuple(titles.index(title) for title in ("µs a step", "transitions", "awareness", "inputs", "of the way"))
    show_table(rows, titles, left=(1, 2), spare=needs)
    if name is None:
        return
    rows = []
    others = [one.team for one in results.standings() if one.rank and one.team != name]
    for title in bench.SCENARIOS:
        means = {team: results.mean(team, [title]) for team in (name, *others)}
        best = max(others, key=lambda team: means[team].mean)  # type: ignore[union-attr]
        way = bench.way_text(results.way(name, [title]))
        rows.append((
            title, written(means[name]), best, written(means[best]),
            written(results.difference(name, best, [title]), "+.1f"), way and f"{way} %",
        ))  # fmt: skip
    titles = ("scenario", f"{name} [%]", "best other", "observes [%]", "difference", "of the way")
    show_table(rows, titles, left=(0, 2), spare=(5, 3, 2))
    if results.percent(name) is not None and results.percent(name).shape[1] < bench.RUNS:  # type: ignore[union-attr]
        say("differences are over the runs that both have, so they are not those of the means; they decide the rank")
    say(f"{bench.BENCHMARK}: means with 95 % intervals; 'of the way' is that from {bench.FLOOR} to {CEILING}")
