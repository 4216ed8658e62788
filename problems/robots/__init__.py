"""Robots: forward kinematics, Jacobians and inertia matrices, stacked over configurations."""
