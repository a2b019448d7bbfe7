"""Reference implementations in plain Python and numpy: slow, simple, without code of the core.

`adaptive_rls` and `rls` follow the equations of the paper as printed; `adaptive_window` is the estimator `HandoverRls`;
`screen`, `matched_pair`, `Baseline`, `Contact`, `Levels` and `Fit` are stages of the scene "handheld", and `handheld` is the whole scene;
`sliding` is the scene of this name. `vector_rls` is the estimator `VectorRls`. The module `stiffening` fits
the ratio against depth.
"""

from palpate.reference.adaptive import AdaptiveWindowTrace, adaptive_window
from palpate.reference.align import Pairs, matched_pair
from palpate.reference.fit import Fit, Misfit
from palpate.reference.idle import Baseline, Contact
from palpate.reference.judgement import Judgement
from palpate.reference.levels import Levels
from palpate.reference.paper import Trace, adaptive_rls, rls
from palpate.reference.readings import Screened, screen
from palpate.reference.tracker import Rows, Touch, handheld, sliding
from palpate.reference.vectors import VectorTrace, vector_rls

__all__ = [
    "AdaptiveWindowTrace",
    "Baseline",
    "Contact",
    "Fit",
    "Judgement",
    "Levels",
    "Misfit",
    "Pairs",
    "Rows",
    "Screened",
    "Touch",
    "Trace",
    "VectorTrace",
    "adaptive_rls",
    "adaptive_window",
    "handheld",
    "matched_pair",
    "rls",
    "screen",
    "sliding",
    "vector_rls",
]
