"""Motion in time: S-curves under limits of velocity, acceleration and jerk (Cao et al. 2012)."""

from nlpweld.motion.limits import Limits
from nlpweld.motion.s_curve import SCurve, s_curve, synchronised

__all__ = ["Limits", "SCurve", "s_curve", "synchronised"]
