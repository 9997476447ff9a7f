"""More than one aim: fronts of a cell's objective against clearance, manipulability or joint travel."""
