"""Pushing a box together, after Kube and Zhang (1994): the task, its worlds, and the law of the box."""
