"""Reference implementations in plain Python and numpy: slow, simple, without code of the core.

`adaptive_rls` and `rls` follow the equations of the paper as printed; `handover_rls` is the estimator of the scene
"handheld", `matched_pair`, `Baseline`, `Contact` and `Fit` are its other stages, and `handheld` is the whole scene.
"""

from palpate.reference.align import Pairs, matched_pair
from palpate.reference.fit import Fit, Misfit
from palpate.reference.handover import HandoverTrace, handover_rls
from palpate.reference.idle import Baseline, Contact
from palpate.reference.paper import Trace, adaptive_rls, rls
from palpate.reference.tracker import Rows, Touch, handheld

__all__ = [
    "Baseline",
    "Contact",
    "Fit",
    "HandoverTrace",
    "Misfit",
    "Pairs",
    "Rows",
    "Touch",
    "Trace",
    "adaptive_rls",
    "handheld",
    "handover_rls",
    "matched_pair",
    "rls",
]
