"""Claims that hold, fall, break off, die or dawdle, to see what the ledger makes of them."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial
from sandbox.claims.exhibit import Axis, Plot, Series


def one() -> int:
    """The right answer."""
    return 1


def other() -> int:
    """The right answer again."""
    return 1


def spoiled(_: Answer) -> Answer:
    """A fault: it says 2."""
    return two


def two() -> int:
    """A wrong answer."""
    return 2


def unnoticed(first: Answer) -> Answer:
    """A fault that changes nothing."""
    return first


def agree(trial: Trial, first: Answer, second: Answer) -> Evidence:
    """Both answers are the same."""
    plot = Plot("answers", Axis("x"), Axis("y"), (Series("answers", [0, 1], [first(), second()]),))
    return Evidence((Check("the same", first() == second(), first(), second(), trial.of(100, 1)),), (plot,))


def disagree(trial: Trial, first: Answer, second: Answer) -> Evidence:
    """Not reproduced; what we say of the cause stands as long as the first path is right."""
    checks = (
        Check("the paper's number", False, 3, 4, trial.of(100, 1)),
        Check("its cause", first() == 1, first(), 1, role=Role.OURS),
    )
    return Evidence(checks, ())


def breaks(trial: Trial, first: Answer, second: Answer) -> Evidence:
    """An error in the examination itself."""
    raise ValueError("out of\ncheese")


def dies(trial: Trial, first: Answer, second: Answer) -> Evidence:
    """The process ends in the full examination."""
    if trial.full:
        os._exit(3)
    return agree(trial, first, second)


def dawdles(trial: Trial, first: Answer, second: Answer) -> Evidence:
    """Long enough to be interrupted."""
    time.sleep(30)
    return agree(trial, first, second)


def claim(
    name: str,
    examine: Callable[[Trial, Answer, Answer], Evidence],
    plant: Callable[[Answer], Answer] = spoiled,
    alone: bool = False,
) -> Claim:
    """A row of a ledger."""
    return Claim(
        name=name, title=name, place="Section I", says="It is so.", tested="By asking twice.", accepted="Equal.",
        paths=(CodePath("first", one), CodePath("second", other)), examine=examine, fault=Fault("it says 2", plant),
        alone=alone,
    )  # fmt: skip
