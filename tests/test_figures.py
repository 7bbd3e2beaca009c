"""Every figure has a provenance entry, and figures older than their code are found."""

import json
import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROVENANCE = runpy.run_path(str(ROOT / "benchmarks" / "provenance.py"))


def test_every_result_and_picture_has_an_entry():
    files = [*(ROOT / "docs" / "images").glob("*.[psg][nvi][gf]"),
             *(ROOT / "benchmarks" / "results").glob("*.jsonl"),
             *(ROOT / "agents" / "policies" / "shipped").glob("*.json")]  # fmt: skip
    entries = PROVENANCE["load"]()
    assert {path.relative_to(ROOT).as_posix() for path in files} == set(entries)
    for name, entry in entries.items():
        assert {"command", "sources", "version", "commit", "date", "machine", "code"} <= set(entry)
        for source in entry["sources"]:
            assert (ROOT / source).exists(), (name, source)


def test_pages_show_pictures_that_have_an_entry():
    pages = "".join(page.read_text() for page in [ROOT / "README.md", *ROOT.glob("docs/**/*.md")])
    for name in PROVENANCE["load"]():
        if name.startswith("docs/images/"):
            assert Path(name).name in pages, name


def test_a_change_of_code_makes_a_figure_stale(tmp_path):
    (tmp_path / "code").mkdir()
    (tmp_path / "code" / "a.py").write_text("x = 1\n")
    hashed = PROVENANCE["code_hash"](["code"], tmp_path)
    entries = {"figure.png": {"sources": ["code"], "code": hashed}}
    assert PROVENANCE["stale"](entries, tmp_path) == []
    (tmp_path / "code" / "a.py").write_text("x = 2\n")
    assert PROVENANCE["stale"](entries, tmp_path) == ["figure.png"]


def test_entries_are_sorted_json():
    text = (ROOT / "benchmarks" / "results" / "provenance.json").read_text()
    assert text == json.dumps(json.loads(text), indent=1, sort_keys=True) + "\n"
