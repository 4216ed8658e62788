"""Section III, second paragraph: methods with the Moore-Penrose pseudoinverse, W = I, and what W = I implies."""

from __future__ import annotations

from sandbox.claims.pseudoinverse import identity_rarely_ideal, pseudoinverse_methods

CLAIMS = (pseudoinverse_methods.CLAIM, identity_rarely_ideal.CLAIM)
