"""Running solvers on cells: one answer, a grid of tasks, and the records they leave."""
