"""Section V, beyond the paper: its study in double precision, on real arms, with W other than I, and for every QP backend.

The task error of an answer is |J qdot - xdot| / |xdot|, evaluated with twice the digits, so that it is the answer's own.
"""

from __future__ import annotations

from sandbox.claims.beyond import backends_in_double, closed_forms_in_double

CLAIMS = (closed_forms_in_double.CLAIM, backends_in_double.CLAIM)
