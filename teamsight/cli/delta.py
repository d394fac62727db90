"""``teamsight delta``: how many neighbours a robot must be ready for, by simulation or from recorded positions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from teamsight.cli.paths import check_apart
from teamsight.cli.settings import SimulatedDeltaSettings, TracksDeltaSettings
from teamsight.cli.show import say, watching, wide_console

if TYPE_CHECKING:
    from teamsight.analysis.delta.report import DeltaReport

_ONLY_TRACKS, _BOTH = {"tracks", "window", "sort"}, {"risk", "awareness_range", "out", "force"}


def execute(**given: Any) -> None:
    """Choose δ and print the report."""
    said = {name: value for name, value in given.items() if value is not None}
    if "tracks" in said:
        _refuse(said, set(said) - _ONLY_TRACKS - _BOTH, "is told by the tracks; leave it out")
        _from_tracks(TracksDeltaSettings(**said))
    else:
        _refuse(said, set(said) & _ONLY_TRACKS, "is for recorded positions; give --tracks too, or leave it out")
        _from_simulation(SimulatedDeltaSettings(**said))


def _refuse(said: dict[str, Any], names: set[str], reason: str) -> None:
    if names:
        name = sorted(names)[0]
        raise ValueError(f"{name}={said[name]}: {reason}")


def _from_simulation(settings: SimulatedDeltaSettings) -> None:
    from teamsight.analysis.delta.choose import choose_delta

    _prepare(settings)
    # The degree of awareness is geometry: it does not depend on what the robots know; the policy may.
    world = settings.model_dump(exclude={"risk", "runs", "steps", "seed", "out", "force"}, exclude_none=True)
    with watching() as watch:
        report = choose_delta(
            world,
            runs=settings.runs,
            steps=settings.steps,
            risk=settings.risk,
            rng=settings.seed,
            progress=lambda done, total: watch("exploring", done, total),
        )
    _show(report, settings)


def _from_tracks(settings: TracksDeltaSettings) -> None:
    from teamsight.analysis.delta.from_trajectories import delta_from_trajectories, read_trajectories
    from teamsight.analysis.delta.report import files_in

    for file in files_in(settings.out) if settings.out else ():
        check_apart("out", file, "tracks", settings.tracks)
    _prepare(settings)
    with watching() as watch:
        tracks = read_trajectories(
            settings.tracks, sort=settings.sort, progress=lambda done, total: watch("reading", done, total)
        )
        report = delta_from_trajectories(
            tracks,
            settings.awareness_range,
            risk=settings.risk,
            window=settings.window,
            progress=lambda done, total: watch("counting", done, total),
        )
    _show(report, settings)


def _asked(settings: SimulatedDeltaSettings | TracksDeltaSettings) -> dict[str, Any]:
    """Return what tells a report from others."""
    return settings.model_dump(mode="json", exclude={"out", "force"}, exclude_none=True)


def _prepare(settings: SimulatedDeltaSettings | TracksDeltaSettings) -> None:
    if settings.out:
        from teamsight.analysis.delta.report import check_report
        from teamsight.analysis.runs.files import prepare_folder

        check_report(settings.out, {"settings": _asked(settings)}, force=settings.force)
        prepare_folder(settings.out)


def _show(report: DeltaReport, settings: SimulatedDeltaSettings | TracksDeltaSettings) -> None:
    files = []
    if settings.out:  # before anything is printed, which may fail
        files = report.save(settings.out, force=settings.force, settings=_asked(settings))
    wide_console().print(report)
    if settings.out:
        say(f"{len(files)} files in {settings.out}")
