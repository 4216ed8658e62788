"""Least kinetic energy, drawn towards a posture.

Run it: sandbox run examples/my_method.py --robot panda --out runs/my_method
"""

import casadi as ca

alpha = 0.5  # [1/s]


def method(robot, q):
    """W (B, n, n) at q (B, n)."""
    return robot.inertia(q)


def f(robot, q):
    """An expression of the symbols q, differentiated by CasADi: a = alpha grad f."""
    return ca.sumsqr(q - 0.2) / 2
