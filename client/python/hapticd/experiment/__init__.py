"""Perception experiments: procedures, protocols, a journal that survives a crash, analysis. docs/experiments.md explains them.

Nothing here is part of a tick: what must be judged or held at 1 kHz is in the daemon (guide, fixture, watch).
"""
