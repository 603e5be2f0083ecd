"""How two runs are compared: quantities, curve metrics, grid convergence, figures."""
