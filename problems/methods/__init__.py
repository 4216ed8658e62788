"""The methods of the paper's section III and three comparators: one module, one row each."""

from __future__ import annotations

from problems.methods import (
    augmented_jacobian,
    damped_least_squares,
    damped_secondary,
    extended_jacobian,
    extended_jacobian_hessian,
    extremum_feedback,
    fault_tolerance,
    free_swinging,
    gradient_projection,
    gravity_torque_gradient,
    inertia_weighted,
    jacobian_transpose,
    joint_limit_gradient,
    joint_stiffness,
    least_squares_rank_deficient,
    manipulability_gradient,
    mussa_ivaldi_hogan,
    obstacle_potential,
    time_scaling,
    two_task_obstacle,
    virtual_load,
    weighted_least_norm,
    weighted_pseudoinverse,
)
from sandbox.method import Method
from sandbox.parameters import chosen

METHODS: dict[str, Method] = {
    row.METHOD.name: row.METHOD
    for row in (
        gradient_projection,
        weighted_pseudoinverse,
        joint_limit_gradient,
        weighted_least_norm,
        manipulability_gradient,
        gravity_torque_gradient,
        obstacle_potential,
        two_task_obstacle,
        fault_tolerance,
        free_swinging,
        augmented_jacobian,
        extended_jacobian,
        extended_jacobian_hessian,
        extremum_feedback,
        joint_stiffness,
        inertia_weighted,
        virtual_load,
        mussa_ivaldi_hogan,
        damped_secondary,
        least_squares_rank_deficient,
        damped_least_squares,
        jacobian_transpose,
        time_scaling,
    )
}
"""In the order of their ids: M1 to M20, C1 to C3."""


def load(name: str) -> Method:
    """The method called `name`, or with that id ("M1").

    Raises UnknownNameError where there is none.
    """
    by_id = {method.id: method for method in METHODS.values()}
    known = {**METHODS, **by_id}
    return known[chosen("method", name.upper() if isinstance(name, str) and name.upper() in by_id else name, known)]
