"""Section III: stiffness, inertia, virtual loads and Mussa-Ivaldi & Hogan's weight as W of eq. (6)."""

from __future__ import annotations

from sandbox.claims.weightings import inertia_weight, mussa_ivaldi_hogan, stiffness_weight, virtual_load_weight

CLAIMS = (
    stiffness_weight.CLAIM,
    inertia_weight.CLAIM,
    virtual_load_weight.CLAIM,
    mussa_ivaldi_hogan.CLAIM,
)
