"""Curves, weld frames, postures and body distances."""
