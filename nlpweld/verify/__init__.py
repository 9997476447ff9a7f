"""The checker that has the last word: every number of a plan computed again, apart from the code that made it.

Imports are lazy, so that the geometry process (:mod:`nlpweld.verify.worker`) starts with NumPy and FCL alone.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nlpweld.verify.check import verify
    from nlpweld.verify.report import Report, Violation
    from nlpweld.verify.robust import verify_robust
    from nlpweld.verify.timing import verify_timing
    from nlpweld.verify.timing_report import TimingReport

__all__ = ["Report", "TimingReport", "Violation", "verify", "verify_robust", "verify_timing"]


def __getattr__(name: str) -> Any:
    if name == "verify":
        from nlpweld.verify.check import verify

        return verify
    if name == "verify_robust":
        from nlpweld.verify.robust import verify_robust

        return verify_robust
    if name == "verify_timing":
        from nlpweld.verify.timing import verify_timing

        return verify_timing
    if name == "TimingReport":
        from nlpweld.verify.timing_report import TimingReport

        return TimingReport
    if name in ("Report", "Violation"):
        from nlpweld.verify import report

        return getattr(report, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
