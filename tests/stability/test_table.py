"""S21: rows and bytes of a pixel by the way its rays are walked."""

import pytest

from harness.stress.execution.table import ROWS, rows_of

BY_NAME = {row.name: row for row in ROWS}
SEED = 20201107


@pytest.mark.parametrize("name, children", [("table", 2), ("table-mirror", 1)])
def test_a_table_doubles_with_each_order_and_a_stack_does_not(strain, serial, name, children):
    found = {
        walk: [strain(serial, name, depth, seed=SEED, walk=walk) for depth in (2, 7, 10)] for walk in ("table", "stack")
    }
    for walk, findings in found.items():
        assert all(finding.failures == 0 for finding in findings)
        sizes = [float(finding.errors[0]) for finding in findings]
        rows = [rows_of(walk, depth, children) for depth in (2, 7, 10)]
        for size, row in zip(sizes, rows, strict=True):
            assert size / sizes[0] == pytest.approx(row / rows[0], rel=0.05)


def test_a_chain_has_no_rows(strain, serial):
    finding = strain(serial, "table-mirror", 20, seed=SEED, walk="chain")
    assert finding.failures == 0 and len(finding.errors) == 0


def test_theory():
    """S21: 8 KB a pixel at depth 5, 262 KB at 10, 268 MB at 20, of 16 columns in float64."""
    expected = BY_NAME["table"].expected
    told = {"walk": "table", "precision": "float64"}
    assert [expected(depth, 0, told) for depth in (5, 10, 20)] == pytest.approx([8e3, 262e3, 268e6], rel=0.02)
    assert expected(20, 0, told | {"walk": "stack"}) == 21 * 128
    assert BY_NAME["table-mirror"].expected(20, 0, told | {"walk": "least"}) == 128
