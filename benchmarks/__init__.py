"""How fast the stage is, against what else one could have written; run apart from the tests."""
