"""What the result tables hold, for machines: Croissant metadata of every committed `results.csv`.

It is written as `reports/croissant.json` by :mod:`experiments.reporting.generated`. Types and columns are those of
:class:`experiments.trials.Row`, title, version, licence and citation those of `CITATION.cff`, sizes and sums those of
the files; the same files give the same bytes.

References
----------
Croissant format specification, version 1.0, MLCommons, https://docs.mlcommons.org/croissant/docs/croissant-spec.html
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from deskew.errors import InputError
from experiments.trials import Row

ROOT = Path(__file__).resolve().parents[2]

_TYPES = {"str": "sc:Text", "int": "sc:Integer", "float": "sc:Float"}
_COLUMNS: Mapping[str, str] = {
    "experiment": "Study that made the row.",
    "condition": "What was measured: control, unrestored, restored, ... and parts joined by slashes.",
    "method": "Flattening method, with its way to scan; - where there is none.",
    "trial": "Which sheet, plane, board or document of the run, from 0.",
    "seed": "Of the run; trial i draws from numpy's SeedSequence([seed, i]).",
    "metric": "Name of the figure; `failed` with value 1 stands for all figures of a trial that gave none.",
    "value": "The figure, finite, in the column `unit`.",
    "unit": "Unit of the value: px, mm, deg, %, ...; 1 for counts, ratios and flags.",
}
_KEY = [name for name in _COLUMNS if name not in ("value", "unit")]
_TERMS = (
    "citeAs column equivalentProperty extract field fileProperty fileObject fileSet format includes isLiveDataset "
    "jsonPath key md5 parentField path recordSet references regex repeated replace samplingRate separator source "
    "subField transform"
)
# As the specification has it, word for word: tools compare it.
_CONTEXT: Mapping[str, Any] = {term: f"cr:{term}" for term in _TERMS.split()} | {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "rai": "http://mlcommons.org/croissant/RAI/",
    "sc": "https://schema.org/",
}


def croissant(reports: Path, citation: Mapping[str, Any]) -> dict[str, Any]:
    """Return the metadata of the tables in a folder of reports.

    Parameters
    ----------
    reports : Path
        Holds `NAME/results.csv`; file objects name them relative to it.
    citation : mapping
        `CITATION.cff`: title, version, license, authors, references.

    Raises
    ------
    InputError
        If the folder holds no table.
    """
    tables = sorted(reports.glob("*/results.csv"))
    if not tables:
        raise InputError(f"`reports` must hold NAME/results.csv, got none in {reports}.")
    paper = citation["references"][0]
    return {
        "@context": dict(_CONTEXT),
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": "deskew-results",
        "description": f"Result tables of {citation['title']}: one row a number, a record set a report. DATASHEET.md "
        "says how the sheets were made and what they do not stand for.",
        "license": f"https://spdx.org/licenses/{citation['license']}.html",
        "version": citation["version"],
        "creator": [{"@type": "sc:Organization", "name": author["name"]} for author in citation["authors"]],
        "citeAs": f"{_authors(citation)}. {citation['title']}. Version {citation['version']}. The method: "
        f"{_authors(paper)}. {paper['title']}. {paper['collection-title']}, {paper['year']}.",
        "isLiveDataset": False,
        "distribution": [_file_object(path, reports) for path in tables],
        "recordSet": [_record_set(path.parent.name) for path in tables],
    }


def _authors(entry: Mapping[str, Any]) -> str:
    named = (a.get("name") or f"{a['given-names']} {a['family-names']}" for a in entry["authors"])
    return " and ".join(named)


def _file_object(path: Path, reports: Path) -> dict[str, Any]:
    content, name = path.read_bytes(), path.relative_to(reports).as_posix()
    return {
        "@type": "cr:FileObject",
        "@id": name,
        "name": name,
        "description": f"All rows of the report {path.parent.name}.",
        "contentUrl": name,
        "contentSize": f"{len(content)} B",
        "encodingFormat": "text/csv",
        "sha256": hashlib.sha256(content).hexdigest(),
    }


def _record_set(report: str) -> dict[str, Any]:
    return {
        "@type": "cr:RecordSet",
        "@id": report,
        "name": report,
        "description": f"One number a record; see {report}/table.md.",
        "key": [{"@id": f"{report}/{name}"} for name in _KEY],
        "field": [
            {
                "@type": "cr:Field",
                "@id": f"{report}/{item.name}",
                "name": item.name,
                "description": _COLUMNS[item.name],
                "dataType": _TYPES[str(item.type)],
                "source": {"fileObject": {"@id": f"{report}/results.csv"}, "extract": {"column": item.name}},
            }
            for item in fields(Row)
        ],
    }


def croissant_text(root: Path = ROOT) -> str:
    """Return the text of `reports/croissant.json` as it should be for what a checkout holds."""
    citation: Any = OmegaConf.to_container(OmegaConf.load(root / "CITATION.cff"))
    return json.dumps(croissant(root / "reports", citation), indent=1, ensure_ascii=False) + "\n"
