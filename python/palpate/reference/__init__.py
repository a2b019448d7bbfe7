"""Reference implementations of the estimators in plain Python and numpy: slow, simple, without code of the core.

`adaptive_rls` and `rls` follow the equations of the paper as printed; `handover_rls` is the estimator of the scene
"handheld".
"""

from palpate.reference.handover import HandoverTrace, handover_rls
from palpate.reference.paper import Trace, adaptive_rls, rls

__all__ = ["HandoverTrace", "Trace", "adaptive_rls", "handover_rls", "rls"]
