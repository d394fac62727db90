"""Figures and pages: `style` has colours and formats, `kinds` the panels, `surface` the surfaces of Touzet's paper.

A figure of a paper is `kinds.panels`, calls of `draw_means`, `draw_distribution` or `draw_heat_map` for its panels, and
`style.to_picture`. `markdown` writes pages.
"""
