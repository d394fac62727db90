"""The evolution of a policy by CMA-ES, and its comparison with A-CMOMMT."""
