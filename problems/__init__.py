"""Robots, problem sets and what they are made of."""
