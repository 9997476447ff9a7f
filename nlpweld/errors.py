"""The errors nlpweld raises on purpose: each message is one line that says what, where, and the mend."""


class NlpweldError(Exception):
    """Base of every error a user can cause; the command line prints it and exits with status 2."""


class CellError(NlpweldError):
    """A cell or robot file cannot be used; names the file, the field and the mend."""


class PlanError(NlpweldError):
    """A plan file cannot be used, or does not belong to the cell it is held against."""


class OptionError(NlpweldError):
    """An option of a command, a solver or a formulation is not one of those there are."""


def missing(what: str, extra: str) -> OptionError:
    """Return the error of a package that is not installed.

    Args:
        what: the package, as people know it, and what asked for it.
        extra: the extra that brings it; pip finds it by the installed nlpweld, in whatever folder it is called.
    """
    return OptionError(f"{what} is not installed; bring it with: pip install 'nlpweld[{extra}]'")


class KinematicsError(NlpweldError):
    """A chain has no closed-form inverse here, or a pose cannot be reached."""


class OutputError(NlpweldError):
    """A file or folder cannot be written."""


class VerifierError(NlpweldError):
    """The geometry process behind ``verify`` hung or died, twice; nothing can be said about the plan."""


class ReferenceFileError(NlpweldError):
    """A reference file cannot be used, or does not hold for the cell or answer it is held against."""


class MotionError(NlpweldError):
    """A motion cannot be timed: a limit, a displacement or a path is not one that motions have."""
