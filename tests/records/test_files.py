"""Records are read back as they were written, or not at all."""

import json

import jsonschema
import pytest
from pydantic import ValidationError

from nlpweld.cell.files import LIBRARY
from nlpweld.errors import OutputError
from nlpweld.records.files import read_record, sealed
from nlpweld.records.model import VERSION, Record
from tests.records.made import record, store

SCHEMA = LIBRARY / "schemas" / f"record-{VERSION}.json"


def assert_refused(path, *told):
    with pytest.raises(OutputError) as caught:
        read_record(path)
    text = str(caught.value)
    assert "\n" not in text
    for part in (str(path), *told):
        assert part in text


def resealed(path, **changes):
    """Change fields of a stored record and seal it again, as another version of this package would."""
    whole = json.loads(path.read_text()) | changes
    del whole["digest"]
    path.write_text(sealed(whole))


def test_a_record_comes_back_as_it_was_written(tmp_path):
    made = record(seed=3, stderr=['a "quoted" line', "ü"])
    path = store(tmp_path, seed=3, stderr=['a "quoted" line', "ü"])
    assert read_record(path) == made
    assert json.loads(path.read_text())["seed"] == 3  # plain JSON for everybody else


def test_a_trace_may_be_left_out(tmp_path):
    path = store(tmp_path)
    bare = read_record(path, trace=False)
    assert bare.trace.time_s == []
    assert bare == record(trace={})


@pytest.mark.parametrize("at", [0, 1, 40, 200, -1])
def test_a_record_cut_anywhere_is_named(tmp_path, at):
    path = store(tmp_path)
    path.write_bytes(path.read_bytes()[:at])
    assert_refused(path)


@pytest.mark.parametrize(("old", "new"), [('"seed": 0', '"seed": 1'), ('"mmr_mean": 0.29', '"mmr_mean": 0.39')])
def test_an_edited_record_is_named(tmp_path, old, new):
    path = store(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    assert_refused(path, "digest", "edited or cut", "run it again")


def test_a_record_written_anew_by_an_editor_is_named(tmp_path):
    path = store(tmp_path)
    path.write_text(json.dumps(json.loads(path.read_text()), indent=2))
    assert_refused(path, "digest: missing")


def test_newer_and_older_versions_are_named(tmp_path):
    path = store(tmp_path)
    resealed(path, version=VERSION + 1)
    assert_refused(path, "version", f"newer than {VERSION}", "update nlpweld")
    path.write_text('{"format": "nlpweld-record", "version": 2}')
    assert_refused(path, f"older than {VERSION}")


def test_what_breaks_the_schema_is_named_by_its_field(tmp_path):
    path = store(tmp_path)
    resealed(path, seed="three")
    assert_refused(path, "seed", "integer")


@pytest.mark.parametrize("text", ["[]", "{}", '{"format": "nlpweld-plan"}', "\x00", "{"])
def test_what_is_no_record_is_named(tmp_path, text):
    path = tmp_path / "a.json"
    path.write_text(text)
    assert_refused(path, "remove it")


def test_nan_never_gets_into_a_record():
    with pytest.raises(ValidationError, match="claimed_objective"):
        record(claimed_objective=float("nan"))


def test_the_published_schema_is_that_of_the_code_and_holds_for_records():
    published = json.loads(SCHEMA.read_text())
    assert published == Record.model_json_schema()
    whole = record().model_dump(mode="json")
    jsonschema.validate(whole, published)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**whole, "status": "FINE"}, published)
