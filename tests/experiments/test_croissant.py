"""Croissant metadata: right about the files, and readable by the reference library."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from deskew.errors import InputError
from experiments.reporting.croissant import ROOT, croissant

REPORTS = ROOT / "reports"
PATH = REPORTS / "croissant.json"


@pytest.fixture(scope="module")
def metadata() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(PATH.read_text())
    return found


def test_every_table_is_listed_with_its_sum_and_size(metadata: dict[str, Any]) -> None:
    listed = {entry["contentUrl"]: entry for entry in metadata["distribution"]}
    assert listed.keys() == {path.relative_to(REPORTS).as_posix() for path in REPORTS.glob("*/results.csv")}
    for name, entry in listed.items():
        content = (REPORTS / name).read_bytes()
        assert entry["sha256"] == hashlib.sha256(content).hexdigest()
        assert entry["contentSize"] == f"{len(content)} B"


def test_fields_are_the_tables_columns(metadata: dict[str, Any]) -> None:
    for entry in metadata["recordSet"]:
        columns = pd.read_csv(REPORTS / entry["name"] / "results.csv", nrows=0).columns
        assert [field["name"] for field in entry["field"]] == list(columns)
        assert len(entry["key"]) == 6


def test_a_folder_without_tables_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="`reports` must hold NAME"):
        croissant(tmp_path, {"references": [{}]})


@pytest.mark.filterwarnings("ignore:ConjunctiveGraph is deprecated")  # rdflib, of itself
def test_the_reference_library_validates_it_and_reads_the_records(metadata: dict[str, Any]) -> None:
    library = pytest.importorskip("mlcroissant", reason="the reference library of Croissant is not installed")
    dataset = library.Dataset(jsonld=str(PATH))
    assert not dataset.metadata.ctx.issues.errors
    report = "real_boards"
    read = pd.DataFrame(list(dataset.records(report))).rename(columns=lambda name: name.removeprefix(f"{report}/"))
    text = read.select_dtypes(object).map(lambda value: value.decode())
    table = pd.read_csv(REPORTS / report / "results.csv", dtype={"unit": str}, keep_default_na=False)
    assert 100 < len(read) == len(table)
    pd.testing.assert_frame_equal(read.assign(**text)[list(table)], table, check_dtype=False, check_exact=True)


@pytest.mark.filterwarnings("ignore:ConjunctiveGraph is deprecated")
def test_the_reference_library_refuses_a_column_from_a_file_that_is_not_listed(
    tmp_path: Path, metadata: dict[str, Any]
) -> None:
    library = pytest.importorskip("mlcroissant", reason="the reference library of Croissant is not installed")
    broken = tmp_path / "croissant.json"
    broken.write_text(json.dumps(metadata | {"distribution": metadata["distribution"][1:]}))
    with pytest.raises(library.ValidationError):
        library.Dataset(jsonld=str(broken))
