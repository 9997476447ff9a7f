"""What the runs of a study say of its solvers: times to a target, expected times, intervals, pairs, profiles."""

SOLVER = ["solver", "preset"]  # what is compared
PROBLEM = ["cell", "formulation"]  # what it is compared on
RUN = [*PROBLEM, *SOLVER, "seed"]  # one row of a table of runs
