"""nlpweld."""
