"""The estimators in plain Python and numpy: slow, obvious, and sharing no code with the core.

`adaptive_rls` and `rls` are the paper's equations as they are printed; `handover_rls` is the estimator for a probe in a hand.
"""

from palpate.reference.handover import HandoverTrace, handover_rls
from palpate.reference.paper import Trace, adaptive_rls, rls

__all__ = ["HandoverTrace", "Trace", "adaptive_rls", "handover_rls", "rls"]
