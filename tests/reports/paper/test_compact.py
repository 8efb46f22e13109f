"""Tables for people: what all rows share stands above, each reason once below, and nothing is lost on the way."""

import report_tables

from reports.paper import markdown

HEADER = ["variant", "time", "memory", "status"]
DEAD = ["cuda", "unavailable", "unavailable", "unavailable: no device"]


def test_what_all_rows_share_is_said_above():
    text = markdown.table(HEADER, [["cpp", "1 s", "9 MB", "ok"], ["numba", "2 s", "9 MB", "ok"]])
    above, table = text.split("\n\n")
    assert above == "The same in all rows: memory: 9 MB; status: ok."
    assert table.splitlines() == ["| variant | time |", "| --- | --- |", "| cpp | 1 s |", "| numba | 2 s |"]


def test_one_row_and_equal_rows_stay_whole():
    for rows in ([["cpp", "1 s", "9 MB", "ok"]], [["cpp", "1 s", "9 MB", "ok"]] * 2):
        assert markdown.table(HEADER, rows).startswith("| variant | time | memory | status |")


def test_a_row_without_a_result_shares_nothing_and_keeps_its_reason():
    text = markdown.table(HEADER, [DEAD, ["cpp", "1 s", "9 MB", "ok"], ["numba", "2 s", "9 MB", "ok"]])
    assert text.startswith("The same in all rows: memory: 9 MB.")
    (rows,) = report_tables.tables(text)
    assert rows[0]["status"] == "unavailable: no device" and rows[1]["status"] == "ok"


def test_reasons_are_notes_each_once():
    rows = [
        ["cpp", "1 s (no interval, n = 2)", "unavailable: no /proc", "ok, but 1 of 2 processes not: failed: x; y"],
        ["numba", "2 s (no interval, n = 2)", "unavailable: no /proc", "failed: exit 1"],
        ["numpy", "3 s", "9 MB", "ok"],
    ]
    text = markdown.table(HEADER, rows)
    assert "| cpp | 1 s (a) | unavailable (b) | ok (c) |" in text and "| numba | 2 s (a) | unavailable (b) | " in text
    assert text.count("no /proc") == text.count("no interval") == 1
    (found,) = report_tables.tables(text)
    assert [list(row.values()) for row in found] == rows


def test_beside_its_thing_a_reason_that_is_there_once_stays():
    rows = [["turbo", "unavailable: no cpufreq", "on"], ["GPU", "none", "unavailable: unsaid"]]
    assert "(a)" not in markdown.table(["what", "here", "there"], rows)
    text = markdown.table(["what", "here", "there"], [*rows, ["swap", "0 B", "unavailable: unsaid"]])
    assert "| turbo | unavailable: no cpufreq | on |" in text and "| swap | 0 B | unavailable (a) |" in text


def test_text_that_is_markdown_already_is_no_reason():
    text = markdown.table(["a", "b", "c", "d"], [["1", "2", "3", markdown.code("ok: echo")]])
    assert "`ok: echo`" in text and "(a)" not in text
