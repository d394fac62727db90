"""Draw the pictures of the documentation again: `.venv/bin/python .ci/pictures.py [NAME.png ...]`.

Without a name it draws all of `DRAWN`, most from the committed table by the function that its command calls; a test
draws them too and compares. Those of `RUN` come from a simulation: their files hold the digest of what made them (a
script, a table, or the code of a page), and are out of date once it changes. Run it, copy its picture, and name it here
to mark it.
"""

from __future__ import annotations

import hashlib
import re
import runpy
import sys
import zlib
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest import mock

import matplotlib
import numpy as np
import pandas as pd

from teamsight.analysis.plot.style import to_picture

if TYPE_CHECKING:
    from teamsight.live import LivePage

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
_MARK = b"teamsight-made-by "
# The most bytes of a picture, less its mark.
_LARGEST = 199_000


def _figure_3() -> bytes:
    from teamsight.analysis.papers import PAPERS
    from teamsight.analysis.papers.touzet2000.figures import FIGURES, pictures

    plan = PAPERS["touzet2000"].plan()
    return pictures(("3", FIGURES["3"].tabulate({}, plan), plan, ["png"]))["png"]


def _of_papers() -> dict[str, Callable[[], bytes]]:
    """Return what draws the figures of the papers that have a page, each from its committed table."""
    from teamsight.analysis.papers import PAPERS

    def drawn(paper: Any, name: str) -> bytes:
        table = pd.read_parquet(ROOT / "docs" / Path(paper.page).parent / f"{paper.name}.parquet")
        return paper.picture(name, paper.restore(table), paper.plan())

    papers = [paper for paper in PAPERS.values() if getattr(paper, "page", "")]
    return {f"{name}.png": partial(drawn, paper, name) for paper in papers for name in paper.figures}


def _lazy_q() -> bytes:
    from teamsight.analysis.learning.diagnosis import diagnosis_points
    from teamsight.analysis.learning.diagnosis_figure import draw
    from teamsight.analysis.learning.plans import Diagnosis

    points = diagnosis_points(pd.read_parquet(ROOT / "docs" / "lazy-q.parquet"))
    return to_picture(draw(points, Diagnosis().in_words()))


def _learning_curves() -> bytes:
    from teamsight.analysis.learning.curve_figure import draw
    from teamsight.analysis.learning.curves import crossings
    from teamsight.analysis.learning.plans import Curves

    gains = pd.read_parquet(ROOT / "docs" / "learning-curves.parquet")
    return to_picture(draw(gains, crossings(gains), Curves()))


def _evolved() -> bytes:
    from teamsight.analysis.papers.evolution import draw

    return to_picture(draw(pd.read_parquet(ROOT / "docs" / "evolved.parquet")))


def _ceilings() -> bytes:
    from teamsight.analysis.ceilings import draw

    return to_picture(draw(pd.read_parquet(ROOT / "docs" / "ceilings.parquet")))


def _hops() -> bytes:
    from teamsight.analysis.papers.hops import draw

    found, possible = (pd.read_parquet(ROOT / "docs" / f"{name}.parquet") for name in ("hops", "ceilings"))
    return to_picture(draw(found, possible))


def _awareness() -> bytes:
    """Draw what one robot knows of the same teammates under each degree, from its percept."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle as Round

    from teamsight import Box, Robot, Target, World
    from teamsight.agents import awareness as degrees

    team = [(0, 0), (0.55, 0.35), (0.8, 0.42), (-0.3, 0.75)]
    team += [(-0.65, -0.2), (0.2, -0.8), (1.7, 0.75), (2.35, 0.1), (-1.5, -0.7)]
    targets = [(0.5, 0.85), (-0.8, 0.7), (2.1, 0.9), (-0.2, -0.35), (-1.9, -0.35)]
    panels = [
        ("none, Θ(0)", degrees.NoAwareness(), "no teammate"),
        ("ring of 8, Θ(1)", degrees.RingAwareness(8), "the nearest in each sector"),
        ("nearest 3, Θ(1)", degrees.NearestAwareness(3), "a list of the nearest"),
        ("pairwise, Θ(N)", degrees.PairwiseAwareness(), "all in range"),
        ("shared, o(N)", degrees.SharedAwareness(), "and the targets that they sense"),
        ("relayed over 2 hops, o(N)", degrees.RelayedAwareness(2), "and what they hear from others"),
    ]
    figure = Figure((7.4, 3.5), dpi=200, layout="constrained")
    for axes, (name, degree, meaning) in zip(figure.subplots(2, 3).flat, panels, strict=True):
        world = World(Box(8, 8), rng=1)
        robots = world.add(
            Robot, len(team), policy="stationary", awareness=degree, awareness_range=1.0, sensing_range=0.6
        )
        preys = world.add(Target, len(targets), policy="stationary")
        world.senses(robots, preys)
        for agent, place in [*zip(robots, team, strict=True), *zip(preys, targets, strict=True)]:
            agent.position = place
        robots[0].heading = (1.0, 0.0)
        percept = robots[0].percept
        axes.add_patch(Round((0, 0), 1.0, facecolor="C0", alpha=0.08))
        axes.add_patch(Round((0, 0), 0.6, fill=False, edgecolor="C1", linestyle=":"))
        if "ring" in name:
            for edge in (np.arange(8) + 0.5) * np.pi / 4:
                axes.plot((0, np.cos(edge)), (0, np.sin(edge)), color="0.7", linewidth=0.8, zorder=1)
        axes.plot(*np.transpose(team[1:]), "o", color="0.75", markersize=7)
        axes.plot(*np.transpose(targets), "o", mfc="none", mec="0.75", markersize=6)
        for known, colour in ((percept.teammates, "C0"), (percept.targets, "C1"), (percept.relayed, "C1")):
            for place in known.offset:
                axes.plot((0, place[0]), (0, place[1]), color=colour, linewidth=0.8, alpha=0.6)
                axes.plot(*place, "o", color=colour, markersize=7 if colour == "C0" else 6)
        axes.plot(0, 0, marker=(3, 0, -90), color="black", markersize=11)
        axes.set(aspect="equal", xlim=(-2.2, 2.6), ylim=(-1.15, 1.25))
        axes.set_title(f"{name}\n{meaning}", fontsize=9.5)
        axes.axis("off")
    return to_picture(figure)


def _reference_results() -> bytes:
    from teamsight.analysis.benchmark import Results, draw

    return to_picture(draw(Results.read()))


def _bodies() -> bytes:
    import io

    from PIL import Image

    from teamsight import Box, Robot, World
    from teamsight.view.drawing import Drawing

    world = World(Box(6, 3), contact="slide", rng=4)
    world.add(Robot, 16, policy="random-walk", radius=[0.2] * 14 + [0.5] * 2, sensing_range=0.01, awareness_range=0.01)
    drawing, buffer = Drawing(world.record(steps=60).tracks, 640), io.BytesIO()
    # Without the chart and the legend, which have nothing to show.
    Image.fromarray(drawing.show(60)[44:-108]).save(buffer, "png")
    return buffer.getvalue()


def _delta() -> bytes:
    from teamsight.analysis.delta import choose_delta

    settings = {"robots": 30, "targets": 15, "radius": 5.0, "policy": "random-walk"}
    return choose_delta(settings, steps=600, risk=0.01, rng=0).to_png()


def _drives() -> bytes:
    import runpy

    from matplotlib.figure import Figure

    example = runpy.run_path(str(ROOT / "examples" / "drives.py"))
    figure = Figure((9, 3.2), layout="constrained")
    names = [name for name in example["DRIVES"] if name != "two wheels, at once"]
    for axes, name in zip(figure.subplots(1, len(names), sharey=True), names, strict=True):
        path, _ = example["patrolled"](example["DRIVES"][name], 170)
        axes.plot(*path.T, lw=1)
        axes.plot(*path[::10].T, ".", ms=4, color="tab:blue")
        axes.plot(*example["CORNERS"].T, "o", ms=8, mfc="none", color="tab:red")
        axes.set(title=name, aspect="equal", xlim=(-2.6, 2.6), ylim=(-2.6, 2.6))
    return to_picture(figure)


def _avoiding() -> bytes:
    import runpy

    from matplotlib import colormaps
    from matplotlib.collections import EllipseCollection

    from teamsight.analysis.plot.style import canvas

    example = runpy.run_path(str(ROOT / "examples" / "avoiding.py"))
    robots, size = example["ROBOTS"], 2 * example["RADIUS"]
    world = example["circle"](example["Avoiding"](example["Cross"]()))
    figure = canvas(8.0, 2.2)
    for place, tick in enumerate((0, 400, 700, 1100)):
        world.run(tick - world.tick)
        axes = figure.add_axes((place / 4, 0, 1 / 4, 0.9))
        axes.set(aspect="equal", xlim=(-16, 16), ylim=(-16, 16), title=f"step {tick}")
        axes.set_axis_off()
        axes.add_collection(EllipseCollection(
            [size] * robots, [size] * robots, [0] * robots, units="xy", offsets=world.groups[0].position.copy(),
            offset_transform=axes.transData, color=[colormaps["hsv"](robot / robots) for robot in range(robots)],
        ))  # fmt: skip
    return to_picture(figure)


def _lidar() -> bytes:
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle as Round
    from matplotlib.patches import Polygon as Ring

    from teamsight import Box, Circle, Lidar, Robot, World

    world = World(Box(8, 4).with_obstacles(Circle((1.6, 0.9), 0.6)), contact="slide", rng=5)
    lidar = Lidar(rays=33, range=2.5, field_of_view=4.0)
    robots = world.add(Robot, 9, policy="random-walk", radius=0.2, lidar=lidar)
    figure = Figure(figsize=(6.4, 3.2), layout="constrained")
    axes, outline = figure.add_subplot(), world.arena.outline()
    axes.add_patch(Ring(outline.wall, facecolor="white", edgecolor="black"))
    for corners in outline.obstacles:
        axes.add_patch(Ring(corners, facecolor="0.75", edgecolor="black"))
    (x, y), (ahead, left) = robots.position[0], robots.heading[0]
    for angle, reading in zip(lidar.bearings, robots.percept.lidar[0], strict=True):
        way = np.cos(angle) * np.array([ahead, left]) + np.sin(angle) * np.array([-left, ahead])
        is_met = reading < lidar.range
        axes.plot(*zip((x, y), (x, y) + reading * way, strict=True), color="C1" if is_met else "C0", alpha=0.5, lw=1)
        axes.plot(*((x, y) + reading * way), "." if is_met else "", color="C1")
    for place in robots.position:
        axes.add_patch(Round(tuple(place), 0.2, facecolor="C0", zorder=3))
    axes.set(aspect="equal", xlim=(-4.05, 4.05), ylim=(-2.05, 2.05))
    axes.axis("off")
    return to_picture(figure)


def _tasks() -> bytes:
    """Draw each task after some steps of its team with skill, or of one that explores where skill has to be learned."""
    from matplotlib.figure import Figure

    from teamsight import TASKS
    from teamsight.view.drawing import Drawing

    figure = Figure((7.4, 4.0), dpi=200, layout="constrained")
    for axes, (name, task) in zip(figure.subplots(2, 4).flat, TASKS.items(), strict=True):
        world = task.build("explore" if callable(task.skilled) else "skilled", rng=3)
        replay = world.record(steps=60, title=name)
        # Without the title, the chart and the legend.
        axes.imshow(Drawing(replay.tracks, 360).show(len(replay.frames) - 1)[44:-108])
        axes.set_title(name, fontsize=11)
        axes.axis("off")
    return to_picture(figure)


def _social_card() -> bytes:
    """Draw what a link to the site shows elsewhere: the question, and the two teams that answer it."""
    import io

    from matplotlib.figure import Figure
    from PIL import Image

    from teamsight.cli import demo
    from teamsight.view.drawing import Drawing

    replay = demo._make_recording(seed=1, steps=300, every=4)
    figure = Figure((12, 6.3), dpi=100, facecolor="white")
    figure.text(0.5, 0.86, "teamsight", size=40, weight="bold", ha="center")
    figure.text(0.5, 0.765, "How much must each robot of a team know of its teammates?", size=24, ha="center")
    # Without the chart and the legend.
    teams = Drawing(replay.tracks, 760).show(len(replay.frames) - 1)[:-108]
    figure.figimage(teams, 600 - teams.shape[1] // 2, 448 - len(teams))
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    content = io.BytesIO()
    Image.open(buffer).convert("RGB").quantize(64).save(content, "png", optimize=True)
    return content.getvalue()


def _diagram(width: float, height: float) -> tuple[Any, Any]:
    """Return a figure and its axes, whose unit is an inch."""
    from matplotlib.figure import Figure

    figure = Figure((width, height), dpi=220)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, width), ylim=(0, height))
    axes.axis("off")
    return figure, axes


def _box(axes: Any, x: float, y: float, width: float, title: str, text: str, colour: str) -> None:
    """Draw a box of a diagram, 0.56 high, with a title and a line below it."""
    from matplotlib.patches import FancyBboxPatch

    shape = "round,pad=0,rounding_size=0.07"
    axes.add_patch(FancyBboxPatch((x, y), width, 0.56, boxstyle=shape, fc="white", ec=colour, lw=1.5))
    axes.text(x + 0.12, y + 0.35, title, size=10.5, weight="bold", color=colour)
    axes.text(x + 0.12, y + 0.11, text, size=9.5)


def _arrow(axes: Any, *path: tuple[float, float], colour: str = "black") -> None:
    """Draw a line that ends in an arrow."""
    axes.plot(*np.transpose(path[:-1]), color=colour, lw=1.5, solid_joinstyle="miter")
    style = {"arrowstyle": "-|>", "lw": 1.5, "shrinkA": 0, "shrinkB": 0, "color": colour}
    axes.annotate("", path[-1], path[-2], arrowprops=style)


def _controllers() -> bytes:
    """Draw the loop of a robot, with the percept and the command of the first example of the page."""
    from matplotlib.patches import Circle as Round

    page = (ROOT / "docs" / "controllers.md").read_text(encoding="utf-8")
    found: dict[str, Any] = {"print": str}
    code = page.split("```python\n")[1].split("```")[0]
    exec(code, found)
    ranges = dict(re.findall(r"(\w+)_range=([\d.]+)", code))
    targets, teammates, command = (found[name] for name in ("targets", "teammates", "command"))

    def way(distance: float, angle: float) -> str:
        return f"{distance:g} at {angle:+g} rad".replace("-", "−")

    figure, axes = _diagram(6.4, 3.9)
    axes.axhspan(0.94, 2.62, color="#0072B2", alpha=0.09, lw=0)
    axes.text(5.05, 1.02, "Controller: as in the simulator", ha="center", size=9.5, color="#0072B2")
    seen = ", ".join(map(way, targets.distance, targets.bearing))
    _box(axes, 0.6, 3.2, 3.0, "sensors: targets", seen, "#B34700")
    _box(axes, 3.85, 3.2, 2.4, "radio: teammates", way(teammates.distance[0], teammates.bearing[0]), "#0072B2")
    _box(axes, 0.6, 1.94, 3.0, "degree of awareness", "pairwise: each teammate in range", "#0072B2")
    _box(axes, 0.6, 1.06, 3.0, "policy", "a-cmommt, knows its percept only", "#0072B2")
    go = f"turn {command.turn:+.2f} rad, then go {command.distance:.3f}".replace("-", "−")
    _box(axes, 0.6, 0.1, 3.0, "wheels", go, "#5f5f5f")
    for top, bottom, text in ((3.2, 2.5, "detections"), (1.94, 1.62, "percept"), (1.06, 0.66, "command")):
        _arrow(axes, (1.8, top), (1.8, bottom))
        axes.text(1.9, (top + bottom) / 2, text, va="center", size=9.5)
    _arrow(axes, (4.2, 3.2), (4.2, 2.8), (3.2, 2.8), (3.2, 2.5))
    _arrow(axes, (0.6, 0.38), (0.4, 0.38), (0.4, 3.48), (0.6, 3.48))
    axes.text(0.2, 1.93, "the robot moves, and senses again", rotation=90, ha="center", va="center", size=9.5)
    # The percept, ahead to the right.
    x, y, scale = 5.05, 1.88, 0.17
    axes.add_patch(Round((x, y), float(ranges["awareness"]) * scale, color="#0072B2", alpha=0.12, lw=0))
    axes.add_patch(Round((x, y), float(ranges["sensing"]) * scale, fill=False, ec="C1", ls=":"))
    for detections, colour in ((targets, "C1"), (teammates, "C0")):
        for distance, angle in zip(detections.distance, detections.bearing, strict=True):
            place = (x + scale * distance * np.cos(angle), y + scale * distance * np.sin(angle))
            axes.plot(*zip((x, y), place, strict=True), color=colour, lw=1)
            axes.plot(*place, "o", color=colour, ms=6)
    _arrow(axes, (x, y), (x + 0.6 * np.cos(command.turn), y + 0.6 * np.sin(command.turn)))
    axes.plot(x, y, marker=(3, 0, -90), color="black", ms=10)
    return to_picture(figure)


def _extending() -> bytes:
    """Draw the phases of a tick, and which components act in each."""
    phases = [
        ("events, between ticks", "processes on world.clock, arrivals, Batteries", "#5f5f5f"),
        ("perceive", "Sensor, Lidar, degree of awareness, channels", "#B34700"),
        ("decide", "Policy, or decide of a subclass of Robot", "#0072B2"),
        ("move", "Drive, walls of the Arena, Contact of bodies", "#00714F"),
        ("interact", "Interaction: capture, carrying, pushing", "#00714F"),
        ("search for neighbours", "ranges: who has whom in range, what is observed", "#00714F"),
        ("record", "measure, reward, memory of a learner, recording", "#8A3F6C"),
    ]
    height = 0.72 * len(phases) + 0.06
    figure, axes = _diagram(6.4, height)
    for place, (phase, components, colour) in enumerate(phases):
        y = height - 0.72 * place - 0.62
        _box(axes, 0.8, y, 5.5, phase, components, colour)
        if place:
            _arrow(axes, (3.55, y + 0.72), (3.55, y + 0.56))
    _arrow(axes, (0.8, 0.38), (0.5, 0.38), (0.5, height - 0.34), (0.8, height - 0.34))
    axes.text(0.3, height / 2, "one tick", rotation=90, ha="center", va="center", size=10.5)
    return to_picture(figure)


def _learning() -> bytes:
    """Draw a decision of the paper's learner: a situation, the nearest in the shipped memory, and what is repeated."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle as Round

    from teamsight import CMOMMT
    from teamsight.policies.lazy.lazy_q import lazy_cooperative

    policy = lazy_cooperative()
    world = CMOMMT(robots=10, targets=15, radius=3.0, policy=policy, awareness="ring", rng=1)
    world.run(40)
    situation = world.robots[9].percept.situation
    distance = np.abs(policy.memory.situation - situation).sum(axis=1)
    nearest = np.argsort(distance, kind="stable")[: policy.k]
    values, actions = policy.values[nearest], policy.memory.action[nearest]
    best = int(np.argmax(values))

    figure = Figure((6.4, 4.8), dpi=220, layout="constrained")
    for axes in figure.subplots(2, 3).flat:
        axes.set(aspect="equal", xlim=(-1.12, 1.12), ylim=(-1.12, 1.12))
        axes.axis("off")
    panels = figure.axes

    def show(axes: Any, inputs: Any, ways: Any, title: str) -> None:
        edges = (np.arange(16) + 0.5) * np.pi / 8
        axes.plot((0 * edges, np.cos(edges)), (0 * edges, np.sin(edges)), color="0.88", lw=0.8, zorder=0)
        axes.add_patch(Round((0, 0), 1, fill=False, ec="0.75"))
        for sector, reading in enumerate(inputs):
            if reading < 1:
                angle, marker = np.pi / 8 * (sector % 16), "C1o" if sector < 16 else "C0s"
                axes.plot(reading * np.cos(angle), reading * np.sin(angle), marker, ms=6)
        axes.plot(0, 0, marker=(3, 0, -90), color="black", ms=9)
        for rotation, length, color in ways:
            _arrow(axes, (0, 0), (length * np.cos(rotation), length * np.sin(rotation)), colour=color)
        axes.set_title(title, size=9.5)

    show(panels[0], situation, [], "now\n● target, ■ teammate")
    ordinals = ["nearest", "second", "third", "fourth"]
    for place in range(4):
        color = "#882255" if place == best else "0.45"
        number = nearest[place]
        label = f"{ordinals[place]}, distance {distance[number]:.2f}\nQ = {values[place]:.2f}"
        show(panels[1 + place], policy.memory.situation[number], [(*actions[place], color)], label)
    ways = [(*action, "0.7") for action in actions] + [(*actions[best], "#882255")]
    show(panels[5], situation, ways, f"all {policy.k} nearest: the action\nof the highest Q is repeated")
    return to_picture(figure)


def _tutorial() -> bytes:
    """Draw the report of the tutorial, from the call on its page."""
    page = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    call = re.search(r"^report = .*?^\)$", page, re.DOTALL | re.MULTILINE)
    assert call is not None
    found: dict[str, Any] = {}
    exec(f"from teamsight.analysis.delta import choose_delta\n{call[0]}", found)
    # Sharp on screens of two pixels a point.
    with mock.patch("teamsight.analysis.plot.style._DPI", 200):
        picture: bytes = found["report"].to_png()
    return picture


def _closed_form() -> bytes:
    """Draw the predicted δ against the radius, with the simulated ones of the table of the page."""
    from matplotlib.figure import Figure

    from teamsight.analysis.delta.closed_form import predict
    from teamsight.analysis.plot.style import RADIUS_LABEL, plain, shades

    page = (ROOT / "docs" / "closed-form.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| ([\d.]+) \| [^|]+ \| [^|]+ \| (\d+) / \d+ \|", page, re.MULTILINE)
    radii = np.arange(1.5, 8.01, 0.05)
    figure = Figure((6.4, 3.6), dpi=220, layout="constrained")
    axes = figure.add_subplot()
    for robots, colour in zip((5, 10, 30, 50), shades(4), strict=True):
        deltas = [predict(robots, radius).delta(0.01) for radius in radii]
        axes.step(radii, deltas, where="mid", color=colour)
        axes.text(radii[0] - 0.1, deltas[0], f"N = {robots}", ha="right", va="center")
    simulated = [(float(radius), int(delta)) for robots, radius, delta in rows]
    axes.plot(*np.transpose(simulated), "ko", ms=5)
    axes.annotate("simulated", simulated[2], (-8, -12), textcoords="offset points", ha="right")
    axes.set(xlabel=RADIUS_LABEL.replace("sensing", "awareness"), ylabel="δ for a risk of 0.01")
    axes.set(xlim=(0.7, 8.2), ylim=(0, None))
    plain(axes)
    return to_picture(figure)


def _table_of(page: str, head: str) -> list[list[str]]:
    """Return the cells of the table of a page whose head begins so, with its head."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    lines = text[text.index(f"| {head} |") :].split("\n\n")[0].splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [rows[0], *rows[2:]]


def _numbers(cell: str) -> list[float]:
    """Return the numbers of a cell: a value, and half of its interval if it has one."""
    return [float(number) for number in re.findall(r"-?[\d.]+", cell.replace("−", "-"))]


def _intervals(axes: Any, names: Sequence[str], cells: Sequence[str], colour: str, shift: float = 0) -> None:
    """Draw differences, one below the other, with their intervals; those that include 0 are open."""
    for place, cell in enumerate(cells):
        value, half = _numbers(cell)
        fill = colour if abs(value) > half else "white"
        axes.errorbar(value, place + shift, xerr=half, fmt="o", color=colour, mfc=fill, ms=5, lw=1.4)
    axes.axvline(0, color="0.35", lw=1)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.tick_params(labelsize=8)


def _relatives() -> bytes:
    """Draw the table of the page: how much more than A-CMOMMT each policy observes, but the random walk."""
    from matplotlib.figure import Figure

    from teamsight.analysis.plot.style import plain

    (_, _, _, _, *policies), *rows = _table_of("relatives.md", "radius | awareness_range")
    figure = Figure((7.4, 3.2), dpi=200, layout="constrained")
    names = [f"R = {radius}, range {reach}" for radius, reach, *_ in rows]
    panels = figure.subplots(1, len(policies), sharex=True, sharey=True)
    for column, (axes, policy) in enumerate(zip(panels, policies, strict=True)):
        _intervals(axes, names, [row[4 + column] for row in rows], "#0072B2")
        axes.set_title(policy.replace("(", "\n("), fontsize=8.5)
        axes.set_xticks((-0.05, 0, 0.05), ("−0.05", "0", "0.05"), size=7)
        plain(axes)
    figure.supxlabel("observed fraction, minus that of a-cmommt (help: minus that of BCmommt(answer=0))", fontsize=9)
    return to_picture(figure)


def _imagined_worlds() -> bytes:
    """Draw both tables of the page: what imagined worlds give, and what the parts of the policy are worth."""
    from matplotlib.figure import Figure

    from teamsight.analysis.plot.style import plain

    gains = _table_of("imagined-worlds.md", "what is different")
    parts = _table_of("imagined-worlds.md", "as at the start")
    figure = Figure((7.4, 5.6), dpi=200, layout="constrained")
    above, below = figure.add_gridspec(2, 1, height_ratios=(6, 17)).subplots()
    names, by_hand, guessed = zip(*(cells[:1] + cells[2:4] for cells in gains[1:]), strict=True)
    _intervals(above, names, by_hand, "#0072B2", -0.15)
    _intervals(above, names, guessed, "#D55E00", 0.15)
    above.text(0.985, 0.16, "minus law by hand", color="#0072B2", size=8.5, ha="right", transform=above.transAxes)
    above.text(0.985, 0.04, "minus guessed model", color="#B34700", size=8.5, ha="right", transform=above.transAxes)
    above.set_title("learned in imagined worlds, by what is different [pp]", fontsize=9.5, loc="left")
    _intervals(below, [cells[0] for cells in parts[2:]], [cells[2] for cells in parts[2:]], "#882255")
    below.set_title("minus the whole, with one part as at the start [pp]", fontsize=9.5, loc="left")
    plain(above)
    plain(below)
    return to_picture(figure)


def _claims() -> bytes:
    """Draw the table of the page: the gain from awareness against the radius, for both learners."""
    from matplotlib.figure import Figure

    from teamsight.analysis.plot.style import RADIUS_LABEL, plain

    (_, *radii), *rows = _table_of("claims.md", "R")
    figure = Figure((6.4, 3.0), dpi=200, layout="constrained")
    axes = figure.add_subplot()
    for (name, *cells), colour, above in zip(rows, ("#767676", "#0072B2"), (-12, 7), strict=True):
        gains = [_numbers(cell)[0] for cell in cells]
        axes.plot([float(radius) for radius in radii], gains, "o-", color=colour)
        axes.annotate(name, (6, gains[5]), (0, above), textcoords="offset points", color=colour, ha="center")
    axes.axhline(0, color="0.35", lw=1)
    axes.set(xlabel=RADIUS_LABEL, ylabel="gain from awareness [pp]", ylim=(-3, 20))
    plain(axes)
    return to_picture(figure)


def _calibration() -> bytes:
    from teamsight.analysis.papers.calibration import draw

    return to_picture(draw(pd.read_parquet(ROOT / "docs" / "calibration.parquet")))


def _other_simulators() -> bytes:
    """Draw the numbers of inputs that the page names."""
    from matplotlib.figure import Figure

    from teamsight.analysis.plot.style import plain

    text = " ".join((ROOT / "docs" / "other-simulators.md").read_text(encoding="utf-8").split())
    found = [
        re.search(pattern, text)
        for pattern in (
            r"6 nearest\]\(\S+\) has (\d+) inputs, one of all 7 allies (\d+), the window (\d+)",
            r"3 nearest has (\d+) inputs, all four teammates (\d+), the lidar (\d+)",
        )
    ]
    names = [("list of the 6 nearest", "all 7 allies", "window"), ("list of the 3 nearest", "all 4 teammates", "lidar")]
    figure = Figure((7.0, 1.9), dpi=200, layout="constrained")
    titles = ("SISL pursuit, 8 pursuers", "VMAS discovery, 5 agents")
    for axes, title, bars, numbers in zip(figure.subplots(1, 2), titles, names, found, strict=True):
        assert numbers is not None, title
        inputs = [int(number) for number in numbers.groups()]
        axes.bar_label(axes.barh(bars, inputs, color=["#0072B2", "#56B4E9", "#767676"]), padding=3)
        axes.invert_yaxis()
        axes.set_title(title, fontsize=9.5)
        axes.set(xlabel="inputs", xlim=(0, 1.15 * max(inputs)))
        plain(axes)
    return to_picture(figure)


#: What draws a picture at once, most from the committed tables.
DRAWN: dict[str, Callable[[], bytes]] = {
    **_of_papers(),
    "avoiding.png": _avoiding,
    "awareness.png": _awareness,
    "bodies.png": _bodies,
    "calibration.png": _calibration,
    "claims.png": _claims,
    "closed-form.png": _closed_form,
    "controllers.png": _controllers,
    "delta.png": _delta,
    "drives.png": _drives,
    "evolved.png": _evolved,
    "extending.png": _extending,
    "figure-3.png": _figure_3,
    "hops.png": _hops,
    "ceilings.png": _ceilings,
    "imagined-worlds.png": _imagined_worlds,
    "lazy-q.png": _lazy_q,
    "lidar.png": _lidar,
    "learning.png": _learning,
    "learning-curves.png": _learning_curves,
    "other-simulators.png": _other_simulators,
    "reference-results.png": _reference_results,
    "relatives.png": _relatives,
    "social-card.png": _social_card,
    "tasks.png": _tasks,
    "tutorial.png": _tutorial,
}


def _page(open_page: Callable[[], LivePage], shown: str, prepare: str, width: int, scale: float) -> bytes:
    """Take a picture of a page by Chromium, once a condition holds and a statement was run."""
    import io
    import sys

    from PIL import Image

    sys.path.append(str(ROOT / "tests"))
    import browsing

    with browsing.started() as (browser, loop), browsing.driving(loop):
        server = open_page()
        view = browser.new_page(viewport={"width": width, "height": 800}, device_scale_factor=scale)
        view.goto(server.url)
        view.wait_for_function(shown)
        view.evaluate(prepare)
        view.wait_for_timeout(1000)
        shot = Image.open(io.BytesIO(view.screenshot())).convert("RGB")
        view.close()
        server.close()
    buffer = io.BytesIO()
    shot.quantize(96, kmeans=1, dither=Image.Dither.NONE).save(buffer, "png", optimize=True)
    return buffer.getvalue()


def _watch() -> bytes:
    """Return a live page after 300 ticks, with a robot selected."""
    from teamsight import CMOMMT
    from teamsight.live import watch

    return _page(
        lambda: watch(CMOMMT, {"seed": 1}, port=0, browser=False, wait=False, rate=200.0),
        "() => teamsight.view?.tracks[0]?.frames.at(-1)?.time >= 300",
        "() => { teamsight.live.link.send('pause'); teamsight.view.look(300); teamsight.view.select(0, 5); }",
        1200, 1.5,
    )  # fmt: skip


def _recorded() -> bytes:
    """Return the page of recorded robots with the file of the example."""
    import tempfile

    from teamsight.live import watch_trajectories

    example = runpy.run_path(str(ROOT / "examples" / "delta_from_trajectories.py"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trajectories.csv"
        example["record"](path)
        return _page(
            lambda: watch_trajectories(path, 1.0, port=0, browser=False, wait=False),
            "() => document.body.innerText.includes('for a risk of')",
            "() => { teamsight.view.pause(); teamsight.view.look(605); }", 1280, 1.0,
        )  # fmt: skip


#: Those that show a page, which `.ci/pictures.py NAME.png` takes again.
_PAGES = {"recorded.png": _recorded, "watch.png": _watch}
#: What runs for long, and the text that makes it, by picture: a file, and its first part that matches.
RUN: dict[str, tuple[str, str]] = {
    "contacts.png": ("docs/contacts.md", r"(?s)```python.*```"),
    "field-of-view.png": ("examples/field_of_view.py", r"(?s).*"),
    "gathering.png": ("docs/tasks/gathering-index.parquet", r"(?s).*"),
    "recorded.png": ("teamsight/live/assets/recorded.js", r"(?s).*"),
    "study.png": ("docs/studies.md", r"(?s)```toml.*?```sh.*?```"),
    "train_team.png": ("examples/train_team.py", r"(?s).*"),
    "train_ppo.png": ("examples/train_ppo.py", r"(?s).*"),
    # What the part of the page describes.
    "watch.png": ("docs/watch.md", r"(?s)## On the page.*?## Interventions"),
    "two-teams.webp": (".ci/film.py", r"(?s).*"),
}


def made_by(name: str) -> str:
    """Return what a picture of `RUN` has to hold: the digest of what makes it."""
    file, pattern = RUN[name]
    found = re.search(pattern.encode(), (ROOT / file).read_bytes())
    assert found is not None, f"{file}: nothing in it makes {name}"
    return f"{file} {hashlib.sha256(found[0]).hexdigest()[:16]}"


def mark_of(content: bytes) -> str:
    """Return the mark in a PNG or WebP; "" without one."""
    found = re.search(_MARK + rb"([^\0\n]*)\n", content)
    return found[1].decode() if found else ""


def marked(content: bytes, mark: str) -> bytes:
    """Return a PNG or WebP with a mark as its comment, instead of the one that it has."""
    text = _MARK + mark.encode() + b"\n"
    if content.startswith(b"RIFF"):
        # A chunk that readers do not know, and so skip; its length is even.
        content = re.sub(rb"NOTE(?s:....)" + _MARK + rb"[^\0\n]*\n\0?", b"", content)
        content += b"NOTE" + len(text).to_bytes(4, "little") + text + b"\0" * (len(text) % 2)
        return content[:4] + (len(content) - 8).to_bytes(4, "little") + content[8:]
    chunks = _chunk(b"tEXt", b"Comment\0" + text)
    content = re.sub(rb"(?s)....tEXtComment\0" + _MARK + rb"[^\0\n]*\n....", b"", content)
    return content[:-12] + chunks + content[-12:]


def _chunk(kind: bytes, body: bytes) -> bytes:
    return len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")


def _small(content: bytes) -> bytes:
    """Return a picture with fewer colours if it is larger than those of the documentation may be."""
    if len(content) < _LARGEST or content.startswith(b"RIFF"):
        return content
    import io

    from PIL import Image

    buffer = io.BytesIO()
    Image.open(io.BytesIO(content)).convert("RGB").quantize(256, kmeans=1).save(buffer, "png", optimize=True)
    return buffer.getvalue()


def main(names: list[str]) -> None:
    """Draw pictures again; those of `RUN` are only marked, once their command has drawn them."""
    for name in names or DRAWN:
        place = IMAGES / name
        content = (DRAWN | _PAGES).get(name, place.read_bytes)()
        mark = f"matplotlib {matplotlib.__version__}" if name in DRAWN else made_by(name)
        place.write_bytes(marked(_small(content), mark))


if __name__ == "__main__":
    main(sys.argv[1:])
