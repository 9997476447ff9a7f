"""The child process of a multi-start: first how to build the problem, then start after start, through pipes.

What comes is pickled by the parent that started this process, and by nobody else.
"""

import os
import pickle
import queue
import signal
import sys
import threading
from typing import IO, Any

from nlpweld.solvers.starts import Start, attempt, kept


def main() -> None:
    """Answer starts until the parent has gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's, which ends this process
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing that prints may reach the pipe of answers
    rebuild, solver = pickle.load(sys.stdin.buffer)
    starts: queue.SimpleQueue[Start] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(sys.stdin.buffer, starts), daemon=True).start()
    nlp = kept(rebuild())
    if nlp.prepare:
        nlp.prepare()
    _say(answers, "ready")
    while True:
        _say(answers, attempt(nlp, solver, starts.get()))


def _listen(asked: IO[bytes], starts: "queue.SimpleQueue[Start]") -> None:
    """Take starts as they come; a parent that has gone closes the pipe, even when it was killed."""
    while True:
        try:
            starts.put(pickle.load(asked))
        except EOFError:
            os._exit(0)


def _say(answers: IO[bytes], what: Any) -> None:
    pickle.dump(what, answers)
    answers.flush()


if __name__ == "__main__":
    main()
