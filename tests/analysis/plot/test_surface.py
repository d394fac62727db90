"""Surface and heat map show the same cells in the same colours."""

from __future__ import annotations

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import Normalize

from teamsight.analysis.plot.kinds import outline
from teamsight.analysis.plot.style import canvas, signed
from teamsight.analysis.plot.surface import Look, draw_row, facets_of

NORM, COLOURS = Normalize(-90, 90), matplotlib.colormaps["RdBu"]


def grid(values: list[list[float]]) -> pd.DataFrame:
    rows, columns = np.shape(values)
    return pd.DataFrame(values, index=[1, 2, 5, 30][:rows], columns=[1.0, 2.0, 4.0][:columns])


@pytest.mark.parametrize("shape", [(2, 2), (4, 3), (2, 3)])
def test_facets_around_a_vertex_have_the_colour_of_its_cell(shape: tuple[int, int]) -> None:
    values = grid(np.random.default_rng(3).uniform(-90, 90, shape).tolist())
    facets, colour = facets_of(values, NORM, COLOURS)
    assert len(facets) == len(colour) == 4 * (shape[0] - 1) * (shape[1] - 1)
    for (row, column), value in np.ndenumerate(values.to_numpy()):
        vertex = [values.index[row], values.columns[column], value]
        around = np.isclose(facets, vertex).all(axis=2).any(axis=1)
        at_edges = (row in (0, shape[0] - 1)) + (column in (0, shape[1] - 1))
        assert around.sum() == 4 // 2**at_edges
        assert colour[around] == pytest.approx(np.broadcast_to(COLOURS(NORM(value)), (around.sum(), 4)))


def test_facets_lie_on_the_surface_through_the_cells() -> None:
    facets, _ = facets_of(grid([[0.0, 10.0], [20.0, 70.0]]), NORM, COLOURS)
    heights = {(x, y): z for x, y, z in facets.reshape(-1, 3)}
    means = {(1.0, 1.0): 0, (1.0, 1.5): 5, (1.0, 2.0): 10, (1.5, 1.0): 10, (1.5, 1.5): 25, (1.5, 2.0): 40}
    assert heights == means | {(2.0, 1.0): 20, (2.0, 1.5): 45, (2.0, 2.0): 70}


def test_the_heat_map_writes_every_cell_and_brackets_the_open_ones() -> None:
    cells = grid([[10.0, -20.0], [0.4, 90.0]])
    figure = canvas(13.6, 8.6)
    draw_row(figure, cells, Look("gain", "{:.0f}".format, -90, 90, True), open_cells=cells.abs() < 15)
    (flat,) = (axes for axes in figure.axes if axes.images)
    numbers, names = flat.collections
    assert [path.vertices.tolist() for path in names.get_paths()] == [outline(n).vertices.tolist() for n in ("1", "2")]
    shapes = {text: outline(text).vertices.tolist() for text in ("(10)", "-20", "(0)", "90", "10", "0")}
    written = {
        tuple(place): [text for text, shape in shapes.items() if path.vertices.tolist() == shape]
        for place, path in zip(numbers.get_offsets(), numbers.get_paths(), strict=True)
    }
    assert written == {(0, 0): ["(10)"], (1, 0): ["-20"], (0, 1): ["(0)"], (1, 1): ["90"]}


def test_a_scale_around_zero_ends_where_the_cells_do() -> None:
    figure = canvas(13.6, 8.6)
    draw_row(figure, grid([[10.0, -3.2], [0.4, 20.7]]), Look("gain", signed, -90, 90, True))
    (bar,) = (axes for axes in figure.axes if axes.name != "3d" and axes.get_ylabel() == "gain")
    assert bar.get_ylim() == pytest.approx((-3.2, 20.7))


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.04, "0.0"), (-0.04, "0.0"), (0.06, "+0.1"), (-1.96, "−2.0"), (9.94, "+9.9"), (9.96, "+10"), (-23.5, "−24")],
)
def test_small_differences_have_a_decimal(value: float, text: str) -> None:
    assert signed(value) == text
