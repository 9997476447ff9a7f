"""Ways to run CasADi functions over arrays: it knows graphs and numbers, and nothing of robots."""
