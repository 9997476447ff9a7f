"""From a cell to a nonlinear program: couplings, the stage graph, and its readers."""
