"""What holds at the extremes, measured: a table of rayvox's answers, and of OctoMap's, Coal's and FCL's on the same.

    python -m benchmarks.extremes [--only TOPIC] [--quick] [--write]

Each row: what must hold, answers checked and wrong, the worst error and the bound that users are told, and how many
answers of the others are wrong. --write: results/extremes.json and from it the table in docs/numerical_contract.md.
FCL and Coal need what peers/mesh_peers.py says; a library that is not there is left out and said to be.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from typing import Any

import rayvox

from benchmarks.extreme_cases import all_cases
from benchmarks.extreme_cases.case import Case, Outcome, PeerOutcome, holds
from benchmarks.report import REPOSITORY, print_table, provenance, write_results

PAGE = REPOSITORY / "docs" / "numerical_contract.md"
BEGIN, END = "<!-- extremes: generated -->", "<!-- end of extremes -->"
INSTRUCTION_SETS = ("avx512", "avx2", "portable")
_INSTRUCTION_SETS_TOPIC = "instruction sets"
_PEERS = ("OctoMap", "Coal", "FCL")

Row = dict[str, Any]


def measured(case: Case, with_peers: bool) -> Row:
    """A case's row."""
    outcome = case.run()
    return {
        "topic": case.topic,
        "case": case.name,
        "must_hold": case.must_hold,
        **_numbers(outcome),
        "bound": case.bound,
        "unit": case.unit,
        "holds": holds(case, outcome),
        "peers": {name: _peer_row(ask()) for name, ask in case.peers.items()} if with_peers else {},
    }


def _peer_row(outcome: PeerOutcome) -> Row | str:
    return outcome if isinstance(outcome, str) else _numbers(outcome)


def _numbers(outcome: Outcome) -> Row:
    # JSON takes none of numpy's types.
    return {"checked": int(outcome.checked), "wrong": int(outcome.wrong), "worst_error": float(outcome.worst_error)}


def failures_with(instruction_set: str) -> Outcome | None:
    """All cases that say something of kernels, in a process that is told which to use; None where it cannot run."""
    command = [sys.executable, "-m", "benchmarks.extremes", "--own"]
    environment = os.environ | {"RAYVOX_SIMD": instruction_set}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=REPOSITORY)
    if "not known here" in done.stderr:
        return None
    done.check_returncode()
    rows: list[Row] = json.loads(done.stdout)
    return Outcome(sum(row["checked"] for row in rows), sum(not row["holds"] for row in rows))


def instruction_set_rows() -> list[Row]:
    """The other rows once more with each instruction set."""
    rows = []
    for name in INSTRUCTION_SETS:
        if (outcome := failures_with(name)) is None:
            continue
        must = "every row above but the slowest holds"
        case = Case(_INSTRUCTION_SETS_TOPIC, name, must, lambda found=outcome: found)  # type: ignore[misc]
        rows.append(measured(case, with_peers=False))
    return rows


def _peer_cell(row: Row, name: str) -> str:
    answer = row["peers"].get(name, "")
    if isinstance(answer, str):
        return answer
    return f"{answer['wrong']:,} of {answer['checked']:,}"


def _worst_cell(row: Row) -> str:
    if not row["unit"]:
        return ""
    return f"{row['worst_error']:.1e} <= {row['bound']:.1e} {row['unit']}"


def table(rows: list[Row]) -> tuple[list[str], list[list[str]]]:
    """Header and cells."""
    header = ["extreme", "case", "wrong of checked", "worst error <= bound told", *(f"{p} wrong" for p in _PEERS)]
    cells = []
    for row in rows:
        verdict = "" if row["holds"] else " FAILS"
        counts = f"{row['wrong']:,} of {row['checked']:,}{verdict}"
        cells.append([row["topic"], row["case"], counts, _worst_cell(row), *(_peer_cell(row, name) for name in _PEERS)])
    return header, cells


def page_with(page: str, results: Row) -> str:
    """The page with its table made anew from results/extremes.json."""
    where, rows = results["provenance"], results["results"]
    header, cells = table(rows)
    lines = [
        f"`{where['command']}`, commit {where['commit']}, {where['processor']}, {where['instruction_set']}: "
        f"{sum(row['holds'] for row in rows)} of {len(rows)} rows hold.",
        "",
        "| " + " | ".join(header) + " |",
        "|" + "---|" * len(header),
        *("| " + " | ".join(row) + " |" for row in cells),
        "",
        "What must hold, by extreme:",
        "",
    ]
    said = dict.fromkeys((row["topic"], row["must_hold"]) for row in rows)
    lines += [f"* {topic}: {must}." for topic, must in said]
    before, rest = page.split(BEGIN)
    after = rest.split(END)[1]
    return before + BEGIN + "\n" + "\n".join(lines) + "\n" + END + after


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="What holds at the extremes.")
    parser.add_argument("--only", metavar="TOPIC", help="topics that contain this")
    parser.add_argument("--quick", action="store_true", help="without the slowest cases and the other instruction sets")
    parser.add_argument("--write", action="store_true", help="results/extremes.json and docs/numerical_contract.md")
    parser.add_argument("--own", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    chosen = [case for case in all_cases() if (arguments.only or "") in case.topic]
    if arguments.own or arguments.quick:
        chosen = [case for case in chosen if not case.takes_seconds]
    if arguments.own:
        print(json.dumps([measured(case, with_peers=False) for case in chosen]))
        return
    header, rows = provenance(), []
    for case in chosen:
        rows.append(measured(case, with_peers=True))
        print(f"{'holds' if rows[-1]['holds'] else 'FAILS'}  {case.topic}: {case.name}", file=sys.stderr, flush=True)
    if not (arguments.quick or arguments.only):
        rows += instruction_set_rows()
    print_table(*table(rows))
    if arguments.write:
        results = {"provenance": header, "results": rows}
        print(write_results("extremes", header, rows))
        PAGE.write_text(page_with(PAGE.read_text(), results))
    if failed := [row["case"] for row in rows if not row["holds"]]:
        raise SystemExit(f"{len(failed)} rows do not hold with {rayvox.instruction_set()}: {failed}")


if __name__ == "__main__":
    main()
