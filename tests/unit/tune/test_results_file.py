"""What was measured is taken up."""

from __future__ import annotations

from pathlib import Path

from rayvox.tune.results_file import ResultsFile


def test_figures_come_back_after_a_restart(tmp_path: Path) -> None:
    first = ResultsFile(tmp_path / "deep" / "results.jsonl", "scans")
    first.add("map", {"scan_s": 0.25, "nested": {"a": [1.5]}})
    first.close()
    again = ResultsFile(tmp_path / "deep" / "results.jsonl", "scans")
    assert again.get("map") == {"scan_s": 0.25, "nested": {"a": [1.5]}}
    assert again.get("other") is None


def test_those_of_another_input_are_not_taken_up_and_not_lost(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    for name in ("one", "other"):
        results = ResultsFile(path, name)
        assert len(results) == 0
        results.add("map", {"name": name})
        results.close()
    assert ResultsFile(path, "one").get("map") == {"name": "one"}


def test_a_torn_last_line_is_ignored_and_spoils_nothing_after_it(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    results = ResultsFile(path, "scans")
    results.add("first", {"x": 1.0})
    results.add("second", {"x": 2.0})
    results.close()
    path.write_bytes(path.read_bytes()[:-9])
    results = ResultsFile(path, "scans")
    assert (results.get("first"), results.get("second")) == ({"x": 1.0}, None)
    results.add("third", {"x": 3.0})
    results.close()
    assert ResultsFile(path, "scans").get("third") == {"x": 3.0}
