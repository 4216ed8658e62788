"""Exact truth: what is right for a problem and a task, decided in rational arithmetic."""

from sandbox.reference.truth import REASONS, Truth, truth, truth_of_qp

__all__ = ["REASONS", "Truth", "truth", "truth_of_qp"]
