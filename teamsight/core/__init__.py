"""Shared by all packages: checks of arguments, files, angles, interrupts, compiled kernels."""
