"""Evolution of the evolved policy's constants, and their comparison with A-CMOMMT; see `evolve`."""
