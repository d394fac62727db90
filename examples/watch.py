"""Watch the paper's team in a browser: ``solara run examples/watch.py``.

It needs mesa's visualisation, ``pip install 'teamsight[viz]'``, and a network, since solara fetches the scripts of its
page from a CDN (without one: ``pip install 'solara[assets]'`` beforehand). Robots and their sensing ranges are blue;
targets are orange, and pale while no robot observes them.
"""

from __future__ import annotations

from mesa.visualization import Slider, SolaraViz, make_plot_component

from teamsight import CMOMMT
from teamsight.agents import make_world_component

PARAMETERS = {
    "robots": Slider("robots", value=10, min=1, max=40, step=1),
    "targets": Slider("targets", value=15, min=1, max=40, step=1),
    "radius": Slider("radius", value=5.0, min=2.0, max=10.0, step=0.5),
    "awareness": {"type": "Select", "label": "awareness", "value": "pairwise", "values": ["none", "pairwise"]},
    "rng": Slider("seed", value=1, min=0, max=100, step=1),
}

model = CMOMMT(robots=10, targets=15, radius=5.0, rng=1)
page = SolaraViz(
    model,
    components=[make_world_component(), make_plot_component("observed")],
    model_params=PARAMETERS,
    name="Cooperative observation of moving targets",
)
