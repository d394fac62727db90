"""All that mesa needs of a world: its names, its collector, its space, its visualisation, and its versions."""
