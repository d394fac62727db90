"""Slow twins: what kernels compute, written like the sentences of the paper."""
