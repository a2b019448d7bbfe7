"""Real-time estimation of a capacitance ratio, and from it of elasticity."""
from palpate._core import AdaptiveRls, AdaptiveRls32, Rls, Rls32
from palpate._core import __version__ as __version__
