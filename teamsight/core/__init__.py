"""What every package may use: checks of arguments, files, angles, interrupts, compiled kernels."""
