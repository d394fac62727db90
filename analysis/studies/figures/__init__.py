"""Pictures of studies: which cells, which kind of picture, and how each kind is drawn."""

#: Kinds of pictures.
KINDS = ("auto", "heat-map", "lines", "distribution", "scatter")
