"""Section IV: Tables I and II, what follows from them, and how far a count of operations gauges time."""

from __future__ import annotations

from sandbox.claims.cost import count_as_gauge, identity_exploited, projection_methods
from sandbox.claims.cost.less_operations import GENERAL_CHEAPER, LESS_THAN_60_PERCENT, MORE_SIGNIFICANT
from sandbox.claims.cost.tables import TABLE_1, TABLE_2

CLAIMS = (
    TABLE_1, TABLE_2, LESS_THAN_60_PERCENT, MORE_SIGNIFICANT, GENERAL_CHEAPER, identity_exploited.CLAIM, count_as_gauge.CLAIM,
    projection_methods.CLAIM,
)  # fmt: skip
