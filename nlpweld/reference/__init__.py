"""How good an answer can be at all: the best verified objective of a cell, and a proven bound on every other."""
