"""Scoring: rollouts, results, tables."""

from policy.evaluation.frames import TableError, load_table

__all__ = ["TableError", "load_table"]
