"""How tests call the command line."""

import pytest

from nlpweld.cli import main


@pytest.fixture
def call(capsys):
    def call(*arguments):
        with pytest.raises(SystemExit) as ended:
            main([str(a) for a in arguments])
        shown = capsys.readouterr()
        return ended.value.code, shown.out, shown.err

    return call
