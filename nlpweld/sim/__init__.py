"""Timed plans played in MuJoCo: a closed chain with masses, servos, gravity and contacts (extra ``sim``)."""
